"""Scenarios flown live: the fast run's trajectory through the node, and a person who interferes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.frames import Geodetic, LocalFrame
from protocol.modes import Mode
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.errors import SitlError
from sitl.memory import Memory
from sitl.parameters import TABLE
from sitl.studies.live import ScenarioCraft, ScenarioNode, named
from sitl.studies.scenario import Ask, fly

PEER, NAN = "ground", math.nan
WORLD = World(LocalFrame(Geodetic(43.5648, 1.4811, 150.0)), ARENAS["open"])


class Watched:
    """A scenario on the wire, and a ground station that hears everything; its clock is the vehicle's."""

    def __init__(self, folder, scenario, **options):
        self.craft = ScenarioCraft(scenario, WORLD, **options)
        self.node = ScenarioNode(self.craft, Memory(folder), [PEER])
        self.codec, self.heard = Codec(255, 190), []

    @property
    def now(self):
        return self.craft.vehicle.time

    def advance(self, seconds, *, listen=True):
        for _ in range(round(seconds / 0.01)):
            self.node.advance(5)
            if listen:
                self.collect()
            else:
                self.node.datagrams(self.now)

    def collect(self):
        for _, data in self.node.datagrams(self.now):
            self.heard += self.codec.decode(data)

    def command(self, command, *params):
        seven = (*params, *(NAN,) * (7 - len(params)))
        self.node.receive(
            self.codec.encode(mavlink.MAVLink_command_long_message(1, 1, command, 0, *seven)), PEER, self.now
        )
        self.collect()
        return self.all("COMMAND_ACK")[-1].result

    def set_parameter(self, name, value):
        message = mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, mavlink.MAV_PARAM_TYPE_REAL32)
        self.node.receive(self.codec.encode(message), PEER, self.now)
        self.collect()

    def all(self, kind):
        return [m for m in self.heard if m.get_type() == kind]

    def texts(self):
        """The lines for the pilot, whole."""
        lines = {}
        for number, message in enumerate(self.all("STATUSTEXT")):
            key = message.id or -number
            lines[key] = lines.get(key, "") + message.text
        return list(lines.values())


@pytest.mark.parametrize("name", ["hover", "lqi-wind", "forward-to-hover"])
def test_the_live_flight_is_the_fast_one_sample_for_sample(name, tmp_path):
    scenario = named(name)
    watched = Watched(tmp_path, scenario)
    watched.advance(scenario.duration + 0.02, listen=False)
    live, fast = watched.craft.live.flown, fly(scenario)
    for column in ("time", "p", "v", "q", "actuator", "lyapunov", "law", "target", "energy"):
        np.testing.assert_array_equal(getattr(live, column), getattr(fast, column), err_msg=column)
    assert live.jumps == fast.jumps
    assert watched.craft.live.figures == scenario.figures(fast)


def test_a_listener_hears_the_laws_and_the_jumps_of_the_fast_run(tmp_path):
    scenario = named("forward-to-hover")
    watched = Watched(tmp_path, scenario)
    watched.advance(12.0)
    fast = [jump for jump in fly(scenario).jumps if jump.time < 12.0]
    assert [(m.law_from, m.law_to) for m in watched.all("DARKO_JUMP")] == [(j.source, j.target) for j in fast]
    flown = {m.law for m in watched.all("DARKO_HYBRID_STATE")}
    assert {Law.TO_FORWARD, Law.TO_HOVER, Law.HOVER_LINEAR} <= flown


def test_start_asks_and_figures_are_said(tmp_path):
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


def test_it_holds_where_it_ended(tmp_path):
    watched = Watched(tmp_path, named("hover"))
    watched.advance(20.0)
    assert watched.craft.live.complete
    assert watched.craft.autopilot.mode is Mode.HOLD
    np.testing.assert_allclose(watched.craft.vehicle.truth.body.position, (5.0, 5.0, 105.0), atol=0.1)


def test_a_command_that_moves_the_vehicle_ends_the_scenario(tmp_path):
    scenario = named("far-target")
    watched = Watched(tmp_path, replace(scenario, asks=(*scenario.asks, Ask(7.0, target=(1.0, 2.0, 3.0)))))
    watched.advance(5.0)
    assert watched.command(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH) == mavlink.MAV_RESULT_ACCEPTED
    watched.advance(1.0)
    assert watched.craft.live.interrupted
    assert watched.craft.autopilot.mode is Mode.RTL
    assert "Scenario far-target ended at 5.0 s: the autopilot was told otherwise" in watched.texts()
    watched.advance(2.0)  # beyond the second ask, which is not taken any more
    assert not watched.craft.live.complete
    assert sum(text.startswith("Target") for text in watched.texts()) == 1


def test_a_refused_command_does_not_end_it(tmp_path):
    watched = Watched(tmp_path, named("hover"))
    watched.advance(1.0)
    assert watched.command(mavlink.MAV_CMD_NAV_TAKEOFF) != mavlink.MAV_RESULT_ACCEPTED
    assert watched.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == mavlink.MAV_RESULT_ACCEPTED  # it is armed
    watched.advance(9.02)
    assert watched.craft.live.complete


def test_a_changed_gain_ends_it_and_the_wind_stays(tmp_path):
    watched = Watched(tmp_path, named("lqi-wind"))
    watched.advance(11.0)
    watched.set_parameter("DRK_KPP", 1.0)
    watched.advance(0.1)
    assert watched.craft.live.interrupted
    assert watched.craft.autopilot.mode is Mode.HOLD
    np.testing.assert_allclose(watched.craft.vehicle.wind, (-5.0, 0.0, 0.0), atol=1e-12)


def test_the_wind_of_an_ask_is_told_as_its_parameters(tmp_path):
    watched = Watched(tmp_path, named("lqi-wind"))
    watched.advance(9.0)
    assert not watched.all("PARAM_VALUE")
    watched.advance(1.5)
    assert {(m.param_id, m.param_value) for m in watched.all("PARAM_VALUE")} == {("SIM_WIND_SPD", 5.0)}


def test_a_parameter_of_the_autopilot_does_not_end_it(tmp_path):
    watched = Watched(tmp_path, named("hover"))
    watched.advance(1.0)
    watched.set_parameter("RTL_RETURN_ALT", 20.0)
    watched.advance(9.02)
    assert watched.craft.live.complete


def test_parameters_of_the_command_line_change_the_flight(tmp_path):
    scenario = named("hover")
    watched = Watched(tmp_path, scenario, parameters={"DRK_KPP": 1.0})
    watched.advance(scenario.duration + 0.02, listen=False)
    fast = fly(replace(scenario, tuning=scenario.tuning._replace(kpp=1.0)))
    np.testing.assert_array_equal(watched.craft.live.flown.p, fast.p)


def test_what_the_wire_shows_is_within_every_parameters_bounds(tmp_path):
    craft = ScenarioCraft(named("hover"), WORLD)  # its thresholds are 0 and infinite
    for entry in TABLE:
        assert entry.minimum <= craft.bindings.value(entry.name) <= entry.maximum
    assert craft.vehicle.tuning.v_leave == math.inf


def test_an_unknown_name_is_said_with_those_there_are():
    with pytest.raises(SitlError, match="no live scenario 'motors': there are hover, "):
        named("motors")


def test_an_unfinished_scenario_has_no_track(tmp_path):
    with pytest.raises(SitlError, match="not complete"):
        _ = ScenarioCraft(named("hover"), WORLD).live.flown
