"""Liveness of the table of jumps: goals are reached from every law, and a flight that is stuck is told of."""

import json

import pytest

from sitl import Law, Navigation, Simulation, Start
from sitl.__main__ import main
from sitl.lab.studies import liveness
from sitl.lab.studies.campaign import Spread, draw, fly
from sitl.lab.studies.liveness import (
    FLYING_LAWS,
    LiveDraw,
    LiveFlight,
    LiveGoal,
    fly_to_goal,
    live_draws,
    summary,
)
from sitl.lab.studies.seeded_flights import Craft
from sitl.model.airframe_files import load
from sitl.simulation.situation import hovers_again
from sitl.supervisor.guards import LYAPUNOV_PATIENCE
from tests.support.flights.tunings import BY_REPORT

ON_TRUTH = Craft(navigation=Navigation.TRUTH)
STUCK = LiveFlight(
    LiveDraw(Law.TO_HOVER, LiveGoal.STOP, 2.0, 0.1, 7), 150.0, "TO_HOVER", "0.3 m from its goal after 150 s, V 12"
)


def test_every_law_that_flies_is_begun_in_with_every_goal():
    draws = live_draws([1, 2], [0.0, 8.0], 0.1)
    assert len(draws) == len(set(draws)) == len(FLYING_LAWS) * len(LiveGoal) * 2 * 2
    assert {Law.TO_HOVER, Law.ALIGN, Law.FAILSAFE, Law.INDI} < set(FLYING_LAWS)
    assert not {Law.LANDED, Law.CRASHED} & set(FLYING_LAWS)


@pytest.mark.parametrize(
    ("law", "goal", "wind"),
    [
        (Law.HOVER_ZERO_MOMENT, LiveGoal.HOVER, 3.0),
        (Law.ALIGN, LiveGoal.HOLD, 8.0),
        (Law.FORWARD_LINE_OF_SIGHT, LiveGoal.STOP, 4.0),
    ],
)
def test_a_goal_is_reached_from_a_law_that_did_not_ask_for_it(law, goal, wind):
    flight = fly_to_goal(LiveDraw(law, goal, wind, 0.1, 1), ON_TRUTH)
    assert (flight.fault, flight.last == Law.CRASHED.name) == ("", False)
    assert flight.time < 60.0


def test_a_vehicle_that_stands_is_said_to_hover_although_its_back_transition_never_hands_over():
    """V is that of another law."""
    vehicle = Simulation(
        load("collage").parameters, start=Start(up=20.0, airborne=True), tuning=BY_REPORT._replace(v_enter=0.0)
    )
    vehicle.begin_flight(Law.TO_HOVER)
    vehicle.step(LYAPUNOV_PATIENCE - 1.0)
    assert (vehicle.law, hovers_again(vehicle)) == (Law.TO_HOVER, False)
    vehicle.step(1.0)
    assert (vehicle.law, hovers_again(vehicle)) == (Law.TO_HOVER, True)


@pytest.mark.long
def test_the_mission_that_hovered_short_of_its_end_for_ever_is_done():
    """A wind of 2.3 m/s and a wrong model held V at 12, and the back transition handed over below 10 only."""
    flight = fly(draw(7037, Spread()))
    assert flight.complete
    assert flight.time < 60.0


def test_the_summary_counts_by_law_and_goal_and_names_who_is_stuck():
    done = STUCK._replace(draw=STUCK.draw._replace(seed=8), time=31.0, fault="")
    lines = summary([STUCK, done])
    assert "1/2, 150 s" in lines[1]
    assert lines[-2] == "1 of 2 (1.3 to 98.7 %) reach their goal"
    assert lines[-1] == (
        "stuck: begun in TO_HOVER, stop, 2 m/s, seed 7: in TO_HOVER, 0.3 m from its goal after 150 s, V 12"
    )


@pytest.mark.parametrize(("flown", "code"), [(STUCK, 1), (STUCK._replace(fault=""), 0)])
def test_who_is_stuck_is_an_exit_code(flown, code, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(liveness, "run_live", lambda *_: [flown])
    path = tmp_path / "live.json"
    assert main(["study", "liveness", "--json", str(path)]) == code
    assert json.loads(path.read_text())[0]["draw"]["law"] == "TO_HOVER"
    assert "reach their goal" in capsys.readouterr().out


def test_a_wind_that_nothing_flies_in_is_refused(capsys):
    assert main(["study", "liveness", "--wind", "40"]) == 2
    assert "--wind 40 is not within 0 and 15" in capsys.readouterr().err
