"""Scenarios flown live: the fast run's trajectory through the node, and a pilot who intervenes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.frames import LocalFrame
from protocol.names import Mode
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.errors import SitlError
from sitl.lab.live_scenario import ScenarioAircraft, named
from sitl.lab.scenarios import ScenarioEvent, fly
from sitl.process.vehicle_process import SCENARIO_EXIT_REFUSAL
from sitl.simulation.flight import PERIOD
from sitl.vehicle.parameters import PARAMETERS
from tests.support.vehicle.fake_station import Bench, FakeStation

WORLD = World(LocalFrame(HOME), ARENAS["open"])


class Watched(FakeStation):
    """A ground station that watches a scenario; the link's clock is the vehicle's."""

    def __init__(self, folder, scenario, **options):
        self.aircraft = ScenarioAircraft(scenario, WORLD, **options)
        node_options = {"exit_refusal": SCENARIO_EXIT_REFUSAL}
        super().__init__(Bench(folder, aircraft=self.aircraft, node_options=node_options, settle=0.0))
        self.listens = True

    def advance(self, seconds, *, listen=True):
        self.listens = listen
        step = 5 if listen else 50  # control periods
        for _ in range(round(seconds / PERIOD / step)):
            self.node.advance(step)
            self.bench.now = self.aircraft.vehicle.time
            self.bench.deliver()
        self.listens = True

    def hear(self, data):
        if self.listens:
            super().hear(data)

    def texts(self):
        """The lines for the pilot, whole."""
        lines = {}
        for number, message in enumerate(self.all("STATUSTEXT")):
            key = message.id or -number
            lines[key] = lines.get(key, "") + message.text
        return list(lines.values())


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "duration"), [("hover", 10.0), ("lqi-wind", 20.0), ("jet-gust", 36.0), ("forward-to-hover", 52.0)]
)
def test_the_live_flight_is_the_fast_one_sample_for_sample(name, duration, tmp_path):
    """Until after the last event and the jumps that follow it."""
    scenario = replace(named(name), duration=duration)
    watched = Watched(tmp_path, scenario)
    watched.advance(scenario.duration + 0.1, listen=False)
    live, fast = watched.aircraft.live.flown, fly(scenario)
    for column in ("time", "p", "v", "q", "actuator", "v_hover", "law", "target", "energy"):
        np.testing.assert_array_equal(getattr(live, column), getattr(fast, column), err_msg=column)
    assert live.jumps == fast.jumps
    assert watched.aircraft.live.findings == scenario.findings(fast)


@pytest.mark.long
def test_a_listener_hears_the_laws_and_the_jumps_of_the_fast_run(tmp_path):
    scenario = named("forward-to-hover")
    watched = Watched(tmp_path, scenario)
    watched.ask_for("DARKO_HYBRID_STATE")
    watched.advance(12.0)
    fast = [jump for jump in fly(scenario).jumps if jump.time < 12.0]
    assert [(m.law_from, m.law_to) for m in watched.all("DARKO_JUMP")] == [(j.source, j.target) for j in fast]
    flown = {m.law for m in watched.all("DARKO_HYBRID_STATE")}
    assert {Law.TO_FORWARD, Law.TO_HOVER, Law.HOVER_LINEAR} <= flown


@pytest.mark.long
def test_the_pilot_is_told_the_start_the_events_and_the_findings(tmp_path):
    watched = Watched(tmp_path, replace(named("lqi-wind"), duration=12.0))
    watched.advance(12.02)
    texts = watched.texts()
    assert texts[:3] == [
        "Scenario lqi-wind: 12 s, origin 100 m up",
        "Target [0, 0, 0]",
        "Wind 5 m/s from 0 deg",
    ]
    assert any(text.startswith("MISSED, error at the end") for text in texts)  # two seconds are not enough
    assert texts[-1].startswith("Scenario complete: ")


@pytest.mark.long
def test_the_vehicle_holds_where_the_scenario_ended(tmp_path):
    watched = Watched(tmp_path, named("hover"))
    watched.advance(20.0, listen=False)
    assert watched.aircraft.live.complete
    assert watched.aircraft.autopilot.mode is Mode.HOLD
    np.testing.assert_allclose(watched.aircraft.vehicle.truth.body.position, (5.0, 5.0, 105.0), atol=0.1)


@pytest.mark.long
def test_a_command_that_moves_the_vehicle_ends_the_scenario(tmp_path):
    scenario = named("far-target")
    watched = Watched(
        tmp_path, replace(scenario, events=(*scenario.events, ScenarioEvent(7.0, target=(1.0, 2.0, 3.0))))
    )
    watched.advance(5.0)
    assert watched.command(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH) == mavlink.MAV_RESULT_ACCEPTED
    watched.advance(1.0)
    assert watched.aircraft.live.interrupted
    assert watched.aircraft.autopilot.mode is Mode.RTL
    assert "Scenario far-target ended at 5.0 s: another request was accepted" in watched.texts()
    watched.advance(2.0)  # beyond the second event, which is not applied any more
    assert not watched.aircraft.live.complete
    assert sum(text.startswith("Target") for text in watched.texts()) == 1


def test_a_refused_command_does_not_end_the_scenario(tmp_path):
    watched = Watched(tmp_path, named("hover"))
    watched.advance(1.0)
    assert watched.command(mavlink.MAV_CMD_NAV_TAKEOFF) != mavlink.MAV_RESULT_ACCEPTED
    assert watched.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == mavlink.MAV_RESULT_ACCEPTED  # it is armed
    watched.advance(9.1, listen=False)
    assert watched.aircraft.live.complete


@pytest.mark.long
def test_a_changed_gain_ends_the_scenario_and_the_wind_stays(tmp_path):
    watched = Watched(tmp_path, named("lqi-wind"))
    watched.advance(11.0, listen=False)
    watched.set_parameter("DRK_KPP", 1.0)
    watched.advance(0.1)
    assert watched.aircraft.live.interrupted
    assert watched.aircraft.autopilot.mode is Mode.HOLD
    np.testing.assert_allclose(watched.aircraft.vehicle.wind, (-5.0, 0.0, 0.0), atol=1e-12)


def test_the_wind_of_an_event_is_sent_as_parameters(tmp_path):
    watched = Watched(tmp_path, named("lqi-wind"))
    watched.advance(9.0)
    assert not watched.all("PARAM_VALUE")
    watched.advance(1.5)
    assert {(m.param_id, m.param_value) for m in watched.all("PARAM_VALUE")} == {("SIM_WIND_SPD", 5.0)}


@pytest.mark.long
def test_a_parameter_of_the_autopilot_does_not_end_the_scenario(tmp_path):
    watched = Watched(tmp_path, named("hover"))
    watched.advance(1.0)
    watched.set_parameter("RTL_RETURN_ALT", 20.0)
    watched.advance(9.1, listen=False)
    assert watched.aircraft.live.complete


def test_parameters_of_the_command_line_change_the_flight(tmp_path):
    scenario = named("hover")
    watched = Watched(tmp_path, scenario, parameters={"DRK_KPP": 1.0})
    watched.advance(scenario.duration + 0.1, listen=False)
    fast = fly(replace(scenario, tuning=scenario.tuning._replace(kpp=1.0)))
    np.testing.assert_array_equal(watched.aircraft.live.flown.p, fast.p)


def test_the_parameters_of_a_scenario_are_within_their_bounds(tmp_path):
    aircraft = ScenarioAircraft(named("hover"), WORLD)  # its thresholds are 0 and infinite
    for name, parameter in PARAMETERS.items():
        minimum, maximum = parameter.metadata.bounds
        assert minimum <= aircraft.configuration.value(name) <= maximum
    assert aircraft.vehicle.tuning.v_leave == math.inf


def test_an_unknown_name_is_an_error_that_lists_the_known_ones():
    with pytest.raises(SitlError, match="no live scenario 'motors': there are hover, "):
        named("motors")


def test_an_unfinished_scenario_has_no_track(tmp_path):
    with pytest.raises(SitlError, match="not complete"):
        _ = ScenarioAircraft(named("hover"), WORLD).live.flown
