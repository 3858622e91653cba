"""Panels draw whatever a vehicle sends."""

from hypothesis import given, settings
from hypothesis import strategies as st

from darko_gcs.state.reduce import reduce
from darko_gcs.tui.map_panel import MapPanel
from darko_gcs.tui.widgets.flight_panel import DecisionPanel, FlightPanel, TruthPanel, decision_summary
from darko_gcs.tui.widgets.hybrid_panel import ActuatorPanel, AttitudePanel, HybridPanel
from darko_gcs.tui.widgets.panel import MessagePanel
from protocol.dialect import mavlink
from protocol.wire.codec import Codec
from tests.support.gcs.home import snapshot_after
from tests.support.gcs.messages import position
from tests.support.links.flood import framed

PANELS = (HybridPanel, ActuatorPanel, AttitudePanel, FlightPanel, DecisionPanel, MapPanel, MessagePanel, TruthPanel)
DARKO_MESSAGES = st.integers(53000, 53006)  # ids


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(DARKO_MESSAGES, st.binary(min_size=120, max_size=120)), max_size=6))
def test_any_bits_in_the_dialects_messages_are_drawn(messages):
    s = snapshot_after(position(10, 1.0))
    for number, payload in messages:
        kind = mavlink.mavlink_map[number]
        for decoded in Codec(255, 190).decode(framed(kind, payload[: kind.unpacker.size], 0, (1, 1))):
            s = reduce(s, decoded, 1.0)
    for panel in PANELS:
        panel("", id="x").draw(s, 40, 12)
    decision_summary(s, 40)
