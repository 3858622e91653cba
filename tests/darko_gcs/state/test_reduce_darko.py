"""Messages of DarkO's own dialect folded into the snapshot."""

import math

import pytest

from darko_gcs.state.reduce import reduce
from darko_gcs.state.reduce_telemetry import MAX_V_POINTS
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.state.values import Thresholds
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, LegMode, Saturation
from protocol.units import NO_ITEM
from tests.support.gcs.messages import arrived, decision, jump, path_error
from tests.support.vehicle.darko_messages import actuators, hybrid_state


def after(messages, s=EMPTY_SNAPSHOT):
    for message in messages:
        s = reduce(s, arrived(message), 1.0)
    return s


def test_the_history_of_v_is_on_the_vehicles_clock_and_bounded():
    s = after([hybrid_state(100 * n, v_hover=float(n)) for n in range(MAX_V_POINTS + 50)])
    assert len(s.hybrid.v_history) == MAX_V_POINTS
    assert s.hybrid.v_history[-1][:2] == pytest.approx(((MAX_V_POINTS + 49) / 10, MAX_V_POINTS + 49))
    assert math.isnan(s.hybrid.v_history[-1][2])
    assert after([hybrid_state(1)], s) is not s


def test_the_time_of_a_law_begins_when_it_changes():
    s = after([hybrid_state(1000, Law.HOVER_ZERO_MOMENT), hybrid_state(2000), hybrid_state(5000)])
    assert s.hybrid.law == "hover linear"
    assert s.hybrid.law_since == 2.0


def test_a_repeated_jump_is_counted_once():
    s = after([jump(3, 42.0), jump(3, 42.0)])
    assert [entry.name for entry in s.hybrid.jumps] == ["enter_linear"]


def test_the_thresholds_of_both_linear_laws_are_known_under_every_law():
    s = after([hybrid_state(100, v_forward=7.0), hybrid_state(200, Law.FORWARD_LINEAR, v_forward=7.0)])
    assert (s.hybrid.state.hover, s.hybrid.state.forward) == (Thresholds(50.0, 100.0), Thresholds(5.0, 20.0))
    assert s.hybrid.v_history == (pytest.approx((0.1, 1.0, 7.0)), pytest.approx((0.2, math.nan, 7.0), nan_ok=True))


@pytest.mark.parametrize("law", Law)
def test_the_lyapunov_value_is_that_of_the_law_in_force(law):
    forward = {Law.TO_FORWARD, Law.FORWARD_LINE_OF_SIGHT, Law.FORWARD_LINEAR}
    h = after([hybrid_state(100, law, v_hover=1.0, v_forward=2.0, v_attitude=3.0)]).hybrid.state
    assert h.v == (3.0 if law is Law.HOVER_ATTITUDE else 2.0 if law in forward else 1.0)
    assert h.is_forward == (law in forward)


def test_an_unknown_law_has_its_number_and_no_lyapunov_value():
    s = after([hybrid_state(100, 15)])
    assert s.hybrid.law == "law 15"
    assert math.isnan(s.hybrid.state.v)


def test_saturated_axes_are_remembered_with_their_time():
    pitch, boost = Saturation.PITCH, Saturation.BOOST
    s = after([actuators(1000, saturation=pitch), actuators(2000, saturation=boost), actuators(2500)])
    assert s.actuation.actuators.saturation == 0
    assert s.actuation.saturated_at == {pitch: 1.0, boost: 2.0}


def test_a_decision_shows_how_much_energy_it_saves():
    d = after([decision()]).guidance.decision
    assert (d.seq, d.leg_mode, d.reason, d.distance, d.climb) == (3, 2, 1, 100.0, 10.0)
    assert d.saving == pytest.approx(1 - 1757 / 4983)
    hover = after([decision(way=LegMode.HOVER, energies=(500.0, 2000.0))]).guidance.decision
    assert hover.saving == pytest.approx(0.75)


def test_an_impossible_alternative_has_nothing_to_compare():
    assert math.isnan(after([decision(times=(29.2, math.inf), way=LegMode.HOVER)]).guidance.decision.saving)
    assert math.isnan(after([decision(way=LegMode.NONE)]).guidance.decision.saving)
    assert after([decision(seq=NO_ITEM)]).guidance.decision.seq is None


def test_air_and_path_error_are_in_si_units():
    air = mavlink.MAVLink_darko_air_message(
        time_boot_ms=100,
        wind_estimate=[1.0, 2.0, 0.0],
        wind_true=[1.5, 2.5, 0.1],
        airspeed_estimate=13.0,
        airspeed_true=13.5,
    )
    s = after([air, path_error(-1.75, altitude_error=0.25, distance=42, bearing=90)])
    assert s.estimates.air.wind_estimate == (1.0, 2.0, 0.0)
    assert s.estimates.air.wind_true == pytest.approx((1.5, 2.5, 0.1))
    assert (s.estimates.air.airspeed_estimate, s.estimates.air.airspeed_true) == (13.0, 13.5)
    assert s.guidance.navigation == (-1.75, 0.25, 42.0, pytest.approx(math.pi / 2))
