"""Cases flown: the shipped campaigns fly what the studies fly, bit for bit; orders, ends and errors."""

import math

import pytest

from sitl import Law
from sitl.lab.campaigns.case_flights import CaseAircraft, fly_case, measured_case
from sitl.lab.campaigns.specification import draw, load_specification
from sitl.lab.studies import campaign as square_study
from sitl.lab.studies import falls, holds, landings
from sitl.lab.studies.seeded_flights import DEFAULT_CRAFT
from tests.support.campaigns import SMALL, small

WITH_AUTOPILOT = SMALL.replace("autopilot = false", "").replace('law = "HOVER_ZERO_MOMENT"', "")


def flown(name, number):
    campaign = load_specification(name)
    found = fly_case(campaign, draw(campaign, number))
    assert found.error == ""
    return dict(zip(campaign.measures, found.measures, strict=True)) | {"end": found.end}


@pytest.mark.long(after=1)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_falls_are_those_of_the_study(seed):
    found, study = flown("falls", seed - 1), falls.fly(seed, DEFAULT_CRAFT, windy=True)
    assert (found["lost"], found["back"], found["end"]) == (study.lost, study.time, study.end)


@pytest.mark.long
@pytest.mark.parametrize(("number", "seed", "wind"), [(0, 1, 3.0), (5, 2, 8.0)])
def test_holds_are_those_of_the_study(number, seed, wind):
    found, study = flown("holds", number), holds.fly_hold(holds.HoldConditions(seed, wind, 1.0, 0.1))
    names = ("across", "above", "farthest", "highest", "near")
    assert [found[name] for name in names] == [getattr(study, name) for name in names]


@pytest.mark.long
def test_landings_are_those_of_the_study():
    found, study = flown("landings", 1), landings.fly(2, DEFAULT_CRAFT, 5.0, 0.5)
    assert (found["duration"], found["away"]) == (study.time, pytest.approx(study.away, rel=1e-9))
    assert found["upright"] == (study.end is landings.LandingEnd.UPRIGHT)


@pytest.mark.long
def test_squares_are_those_of_the_study():
    found, study = flown("square", 2), square_study.fly(square_study.draw(3, square_study.Spread()))
    assert [found["duration"], found["used"], found["lowest"]] == [study.time, study.energy, study.lowest]
    assert [found["overshoot"], found["climbed"]] == pytest.approx([study.overshoot, study.climbed], rel=1e-9)
    assert found["complete"] == study.complete


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "number", "end"), [("legs", 0, "mission"), ("returns", 1, "ground"), ("delays", 3, "time")]
)
def test_what_the_other_campaigns_ask_for_is_done(name, number, end):
    found, asked = flown(name, number), load_specification(name).require
    assert found["end"] == end
    assert all(found[judgement] for judgement in asked)


def test_a_case_is_one_flight_and_its_airframe_is_drawn():
    campaign = small()
    first, again, other = (fly_case(campaign, draw(campaign, number)) for number in (1, 1, 3))
    assert first == again
    assert 0.1 < first.measures[0] < 0.5
    assert first.measures[0] != other.measures[0]
    assert first.end == "time"


HOME = 'until = ["home"]\nhome = { at = [0, 0, 50], radius = 1, speed = 9, seconds = 0.06 }\nafter = 0.05'


def test_a_flight_ends_at_the_same_look_whatever_the_stretches_are():
    campaign = small(WITH_AUTOPILOT.replace("[flight]", f"[flight]\n{HOME}"))
    whole, steps = (CaseAircraft(campaign, draw(campaign, 1)) for _ in range(2))
    while not steps.is_over:
        steps.advance(3)
    assert measured_case(whole) == measured_case(steps)
    assert (steps.ended_by, steps.ended_at, steps.vehicle.time) == ("home", pytest.approx(0.06), pytest.approx(0.11))


def test_the_length_of_a_stretch_does_not_change_the_flight():
    campaign = small()
    whole, steps = (CaseAircraft(campaign, draw(campaign, 1)) for _ in range(2))
    while not steps.is_over:
        steps.advance(3)
    assert measured_case(whole) == measured_case(steps)
    assert whole.recorded.recording().time.tolist() == pytest.approx([0.02 * row for row in range(11)])


def test_a_refused_order_is_an_error_of_its_case():
    refused = '[[order]]\ndo = "fail"\nunit = "motor"\nfailure = "off"\ninstance = 7\n[flight]'
    campaign = small(SMALL.replace("[flight]", refused))
    found = fly_case(campaign, draw(campaign, 0))
    assert (found.end, found.error) == ("error", "order 'fail' at 0 s refused: Failure denied: there is no motor 7")
    assert all(math.isnan(value) for value in found.measures)


def test_motors_that_fail_let_it_fall_and_a_parameter_changes_in_flight():
    orders = (
        '[[order]]\nat = 0.1\ndo = "fail"\nunit = "motor"\nfailure = "off"\n'
        '[[order]]\nat = 0.1\ndo = "set"\nparameters = { SIM_WIND_SPD = 5.0 }\n[flight]'
    )
    text = SMALL.replace("[flight]", orders).replace("seconds = 0.2", "seconds = 1.0")
    text = text.replace("[measures]", '[measures]\nsunk = "50 + final(DARKO_TRUTH.position[2])"')
    campaign = small(text)
    found = fly_case(campaign, draw(campaign, 0))
    assert found.error == ""
    assert found.measures[0] > 1.0


def test_an_error_in_the_code_is_kept_with_its_case(monkeypatch):
    monkeypatch.setattr(CaseAircraft, "_throw", lambda *_: 1 / 0)
    campaign = small()
    found = fly_case(campaign, draw(campaign, 0))
    assert found.end == "error"
    assert found.error.startswith("ZeroDivisionError in ")


def test_an_order_is_given_when_the_flight_has_come_so_far_or_at_the_latest():
    """Thrown with 2 m/s: half a decimetre of the way later, or never in still air."""
    orders = """
        [[order]]
        do = "set"
        name = "passed"
        when = "DARKO_TRUTH.position[0] ** 2 + DARKO_TRUTH.position[1] ** 2 > 0.05 ** 2"
        latest = 0.1
        parameters = { SIM_WIND_SPD = 5.0 }
        [[order]]
        do = "throw"
        name = "pushed"
        if = "push > 1 and seed == 2"
        velocity = [0.0, 0.0, 1.0]
        [flight]"""
    text = SMALL.replace("[flight]", orders).replace("seconds = 0.2", "seconds = 0.2\nafter_orders = 0.06\nrate = 100")
    campaign = small(text.replace("[measures]", '[measures]\nwhen = "passed"\nthen = "pushed"'))
    slow, fast, again = (fly_case(campaign, draw(campaign, number)) for number in (0, 1, 3))
    assert slow.measures[:1] + fast.measures[:1] == pytest.approx((0.1, 0.03))
    assert (math.isnan(fast.measures[1]), again.measures[1]) == (True, 0.0)
    aircraft = CaseAircraft(campaign, draw(campaign, 0))
    aircraft.fly()
    assert aircraft.vehicle.time == pytest.approx(0.16)


def test_a_flight_ends_by_a_condition_and_begins_under_a_law_that_is_drawn():
    text = SMALL.replace("[vary]", '[vary]\nlaw = { grid = ["HOVER_LINEAR", "FAILSAFE"] }').replace(
        'law = "HOVER_ZERO_MOMENT"', 'law = "law"'
    )
    ends = "until = [\"regime == 'UPRIGHT' and time > 0.05\"]\nseconds = 0.2"
    campaign = small(text.replace("seconds = 0.2", ends))
    aircraft = CaseAircraft(campaign, draw(campaign, 2))
    assert aircraft.vehicle.law is Law.FAILSAFE
    assert measured_case(aircraft).end == "regime == 'UPRIGHT' and time > 0.05"
    assert aircraft.ended_at == pytest.approx(0.06)


@pytest.mark.parametrize(
    ("orders", "ends", "end"),
    [
        ('[[order]]\ndo = "hold"\n', 'until = ["ground"]\nafter = 0.1', "time"),
        ("", 'until = ["home"]\nhome = { at = [0, 0, 50], radius = 1, speed = 9, seconds = 0.1 }', "home"),
    ],
)
def test_under_the_autopilot_it_flies_to_the_first_end(orders, ends, end):
    campaign = small(WITH_AUTOPILOT.replace("[flight]", f"{orders}[flight]\n{ends}"))
    aircraft = CaseAircraft(campaign, draw(campaign, 0))
    assert measured_case(aircraft).end == end
    assert aircraft.vehicle.time == pytest.approx(0.3 if end == "time" else 0.1, abs=0.021)


def test_controller_noise_and_latency_are_of_the_case():
    vary = '[vary]\nwho = { grid = ["hybrid", "indi"] }\nlate = { choice = [0.02] }'
    text = SMALL.replace("[vary]", vary).replace(
        'navigation = "truth"', 'controller = "who"\nlatency = "late"\nnoise = 3'
    )
    campaign = small(text)
    hybrid, indi = (CaseAircraft(campaign, draw(campaign, number)) for number in (0, 2))
    assert (hybrid.vehicle.tuning.controller, indi.vehicle.tuning.controller) == (3, 1)
    sensors = indi.recorded.avionics.sensors
    assert sensors.pipeline.latency == 0.02
    assert sensors != campaign.files.sensors._replace(pipeline=sensors.pipeline)
