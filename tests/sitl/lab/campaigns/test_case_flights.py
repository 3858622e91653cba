"""Cases flown: the shipped campaigns fly what the studies fly, bit for bit; orders, ends and errors."""

import math

import pytest

from sitl import TABLE, Law, Navigation, Regime, load_airframe
from sitl.lab.campaigns.case_flights import CaseAircraft, fly_case, measured_case
from sitl.lab.campaigns.specification import draw, load_specification
from sitl.lab.studies.spec_studies import NO_UNIT, failing_pairs
from tests.support.campaigns import SMALL, failing, shipped, small
from tests.support.flights import falls
from tests.support.flights.tunings import BY_REPORT

WITH_AUTOPILOT = SMALL.replace("autopilot = false", "").replace('law = "HOVER_ZERO_MOMENT"', "")


# A case of each shipped campaign: figures that were measured by each study's own code before it became a file.
FIGURES = [
    ("falls", {}, 1, {"lost": 22.562597527493, "back": 12.12, "at_home": 1}),
    ("falls", {}, 3, {"lost": 7.400021162117, "back": 13.04}),
    ("falls-calm", {}, 1, {"lost": 18.496220419679, "back": 11.34}),
    (
        "square", {}, 3,
        {
            "duration": 39.76, "used": 2.0160842986592, "lowest": 23.882372170023, "climbed": 1.286067898077,
            "overshoot": 0.152043145983, "off_square": 3.418894299577, "complete": 1, "jumps_made": 1,
        },
    ),
    (
        "holds", {"vary.wind.grid": [8]}, 1,
        {"across": 0.321942349129, "above": 0.190799296121, "farthest": 0.423675051347, "near": 1},
    ),
    ("landings", {}, 5, {"duration": 13.3, "bounce": 0.02, "sink": 0.578086409182, "away": 0.104372023061}),
    ("returns", {}, 1, {"duration": 18.48, "unnoticed": 0.02, "slid": 0.009806629962, "off": 32.572988273596}),
    (
        "returns", {"derived.slope": 5, "derived.ground_height": 2}, 6,
        {"duration": 82.34, "unnoticed": 0.05, "level": 0.245452970225, "off": 0.434574945592, "good": 1},
    ),
    (
        "legs", {"vary.wind.grid": [8], "vary.side.grid": ["head"], "vary.azimuth.grid": [0]}, 1,
        {
            "error": 0.213510961173, "beyond": 0.09042210281, "above": 1.02009783941,
            "farthest_aside": 0.727106665538, "used": 1.720186211525, "jumps_made": 3, "done": 1,
        },
    ),
    (
        "gusts", {"vary.gust.grid": ["Mexican hat, 1.2 Hz"], "vary.rate.grid": [1.2], "vary.mean_wind.grid": [6],
        "vary.by.grid": ["indi"]}, 1, {"farthest": 0.7158741434537, "higher": 0.5709299126, "rejected": 1},
    ),
    ("jet", {"vary.gust.grid": [2], "vary.wall.grid": [4]}, 1, {"error": 0.018006035089, "farthest": 0.044540764765}),
    (
        "failures", failing("gps", "scaled", "return"), 2,
        {"noticed": 2.3, "off": 19.186968832469, "believed_off": 19.933373821615, "came_down": 1, "stayed": 1},
    ),
    (
        "failures", failing("servo", "garbage", "transition"), 1,
        {"noticed": 2.6, "off": 34.286121267045, "believed_off": 1.316077772506, "motors_off": 1},
    ),
    ("failures", failing("motor", "slow", "cruise"), 1, {"off": 15.03368079411, "believed_off": 0.277208442816}),
]  # fmt: skip


@pytest.mark.long(after=2)
@pytest.mark.parametrize(("name", "changes", "seed", "figures"), FIGURES)
def test_a_case_of_a_shipped_campaign_has_the_figures_of_its_study(name, changes, seed, figures):
    flown = shipped(name, changes, seed=seed)
    assert flown.error == ""
    assert {figure: flown.measures[figure] for figure in figures} == pytest.approx(figures, rel=1e-7)


def test_a_vehicle_without_satellites_lands_near_and_stands():
    grids = {"wind": 7.0, "gusts": 1.0, "height": 5.0}
    flown = shipped("lost-position", {f"vary.{name}.grid": [value] for name, value in grids.items()})
    assert (flown.end, flown.measures["stands"]) == ("ground", 1.0)
    assert flown.measures["away"] == pytest.approx(5.823, abs=0.02)  # m, where it was disarmed


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("law", "goal", "wind", "time"),
    [
        ("HOVER_ZERO_MOMENT", "hover", 2, 6.18),
        ("ALIGN", "land", 8, 50.68),
        ("FORWARD_LINE_OF_SIGHT", "stop", 4, 15.86),
        ("ROBUST_PI", "corner", 0, 21.22),
    ],
)
def test_a_goal_is_reached_from_a_law_that_did_not_ask_for_it(law, goal, wind, time):
    vary = load_specification("liveness").vary
    grids = {"law": law, "goal": goal, "wind": wind}
    places = {f"{name}_number": vary[name].values.index(grids[name]) for name in ("law", "goal")}
    numbers = {f"vary.{name}.grid": [vary[name].values[place]] for name, place in places.items()}
    flown = shipped("liveness", {f"vary.{name}.grid": [value] for name, value in grids.items()} | numbers)
    assert (flown.measures["duration"], flown.measures["reached"]) == (pytest.approx(time), 1.0)


@pytest.mark.parametrize(
    ("hover", "noise", "delay", "told", "error", "activity"),
    [
        ("linear hover", 1, 0.0, True, 0.0740652, 12.00333),
        ("zero-moment hover", 2, 0.03, True, 0.1278291, 23.91605),
        ("leg", 1, 0.02, True, 0.8083567, 66.2305),
        ("leg", 1, 0.02, False, 0.8481269, 78.53881),
    ],
)
def test_late_and_noisy_flights_are_those_of_the_study(hover, noise, delay, told, error, activity):
    """To the one sample at the end that the study left out."""
    vary = {"vary.flown.grid": [hover], "vary.noise.grid": [noise], "vary.delay.grid": [delay], "vehicle.told": told}
    found = shipped("delays", vary).measures
    assert (found["error"], found["activity"]) == pytest.approx((error, activity), rel=1e-4)
    assert found["converged"]


@pytest.mark.parametrize(
    ("kind", "by", "velocity", "tuning", "seconds"),
    [
        ("12 m/s level, 8 down", "the supervisor", (12.0, 0.0, -8.0), BY_REPORT, 75.0),
        ("5 m/s down", "one law", (0.0, 0.0, -5.0), falls.ALONE, 30.0),
    ],
)
def test_heights_of_falls_are_those_flown_side_by_side(kind, by, velocity, tuning, seconds):
    grids = {"thrown": kind, "level": velocity[0], "sink": -velocity[2], "by": by}
    found = shipped("fall-heights", {f"vary.{name}.grid": [value] for name, value in grids.items()}, seed=2).measures
    model = load_airframe("collage").parameters
    lost, away = falls.fall([falls.falling(model, 2, velocity, tuning=tuning)], seconds)
    assert (found["lost"], found["away"]) == pytest.approx((lost[0], away[0]), rel=1e-9)


def test_the_map_of_falls_is_that_flown_side_by_side():
    found = shipped("fall-map", {"vary.sink.grid": [10], "vary.tumble.grid": [6]}).measures
    fallen = falls.falling(load_airframe("collage").parameters, 1, (0.0, 0.0, -10.0), tumble=6.0, tuning=BY_REPORT)
    assert found["lost"] == pytest.approx(falls.fall([fallen], 30.0)[0][0], rel=1e-9)


def test_laws_of_liveness_fly_and_have_their_numbers():
    """The study adds what is added to the table."""
    vary = load_specification("liveness").vary
    flying = [law for law in TABLE if law.regime is not Regime.GROUND]
    given = list(vary["law"].values)
    assert given == [law.name for law in flying if law.name in given]
    assert list(vary["law_number"].values) == [float(law) for law in flying if law.name in given]
    assert {"TO_HOVER", "ALIGN", "FAILSAFE", "INDI", "ROBUST_PI"} < set(given)


def test_every_failure_that_the_vehicle_can_have_on_satellites_is_flown():
    vary = load_specification("failures").vary
    pairs = failing_pairs(Navigation.SENSORS)
    known = [pair for name, found in pairs.items() if name != NO_UNIT for pair in found]
    assert list(zip(vary["unit"].values, vary["failure"].values, strict=True)) == known


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


def test_a_warning_is_of_the_look_that_it_comes_before_and_stays_for_others():
    orders = '[[order]]\nat = 0.1\ndo = "fail"\nunit = "motor"\nfailure = "off"\n[flight]\nrate = 5'
    text = WITH_AUTOPILOT.replace("[flight]", orders).replace("seconds = 0.2", "seconds = 3.0")
    text = text.replace('navigation = "truth"', 'navigation = "sensors"')
    campaign = small(text.replace("[measures]", '[measures]\nheard = "warned"\nbeside = "astray"'))
    whole, steps = (CaseAircraft(campaign, draw(campaign, 0)) for _ in range(2))
    read = []
    while not steps.is_over:
        steps.advance(10)
        read += steps.autopilot.notices()
    assert measured_case(whole).measures[:2] == measured_case(steps).measures[:2]
    assert measured_case(whole).measures[0] * 5.0 == pytest.approx(round(measured_case(whole).measures[0] * 5.0))
    assert len({notice.text for notice in read}) == len(read) > 0


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


def test_a_parameter_over_time_is_set_at_every_look():
    text = SMALL.replace("[[order]]", '[parameters]\nSIM_WIND_SPD = "10 * t"\nSIM_WIND_DIR = "push"\n[[order]]')
    campaign = small(text)
    aircraft = CaseAircraft(campaign, draw(campaign, 0))
    aircraft.advance(15)
    assert aircraft.vehicle.wind.x == pytest.approx(-0.2)
    aircraft.fly()
    assert aircraft.vehicle.wind.x == pytest.approx(-1.8)


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
