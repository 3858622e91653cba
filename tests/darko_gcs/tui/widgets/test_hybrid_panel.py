"""Law, Lyapunov values and jumps as text."""

import math
from dataclasses import replace

from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.tui.widgets.hybrid_panel import LAW_STYLES, HybridPanel
from protocol.dialect.vocabulary import Law
from tests.support.gcs.messages import arrived
from tests.support.gcs.screens import panel_text
from tests.support.vehicle.darko_messages import hybrid_state


def shown(message):
    return panel_text(HybridPanel("", id="x"), reduce(EMPTY_SNAPSHOT, arrived(message), 1.0))


def test_every_law_has_a_style():
    assert set(LAW_STYLES) == set(Law)
    assert LAW_STYLES[Law.FAILSAFE] == LAW_STYLES[Law.CRASHED] == "bad"
    assert "CRASHED" in shown(hybrid_state(100, Law.CRASHED))


def test_a_law_that_is_never_left_has_an_infinite_threshold():
    assert "(50/inf)" in shown(hybrid_state(100, v_hover_leave=math.inf))


def test_an_unknown_law_is_shown_by_its_number():
    text = shown(hybrid_state(100, 15, last_law=14, last_reason=13))
    assert "LAW 15" in text
    assert "from law 14: reason 13" in text


def test_a_vehicle_without_a_hybrid_state_is_reported():
    panel = HybridPanel("", id="x")
    assert "no vehicle yet" in panel_text(panel, EMPTY_SNAPSHOT)
    assert "no hybrid state" in panel_text(panel, replace(EMPTY_SNAPSHOT, source=(1, 1)))


def test_the_cause_of_the_last_jump_is_whole_on_a_narrow_panel():
    s = reduce(EMPTY_SNAPSHOT, arrived(hybrid_state(100, jumps=12, last_law=Law.HOVER_ZERO_MOMENT, last_reason=1)), 1.0)
    narrow = " ".join(panel_text(HybridPanel("", id="x"), s, width=38).split())
    wide = panel_text(HybridPanel("", id="x"), s, width=100).splitlines()[2].strip()
    assert wide.startswith("jump 12 from hover zero-moment")
    assert wide in narrow


def test_each_curve_and_threshold_names_its_law():
    s = reduce(EMPTY_SNAPSHOT, arrived(hybrid_state(100, Law.HOVER_LINEAR)), 1.0)
    lines = HybridPanel("", id="x").draw(s, 80, 14)
    text = panel_text(HybridPanel("", id="x"), s, height=14)
    assert "hover leave" in text
    assert "hover enter" in text
    assert {"hover ", "h"} <= {part for line in lines for part, style in line if style == "hover"}
    assert "fwd " in {part for line in lines for part, style in line if style == "forward"}


def test_the_governor_is_never_cut():
    for width in (38, 80):
        s = reduce(
            EMPTY_SNAPSHOT, arrived(hybrid_state(100, Law.HOVER_ZERO_MOMENT, governor=0.95, v_hover=2457.0)), 1.0
        )
        first = panel_text(HybridPanel("", id="x"), s, width=width).splitlines()[0]
        assert first.endswith("governor 95 %")
        assert len(first) <= width
