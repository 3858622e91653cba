"""Studies that are shipped campaigns: their options, their verdicts, and flights that went wrong once."""

import json

import pytest

from sitl import Law, Navigation, Simulation, Start
from sitl.__main__ import main
from sitl.lab.campaigns.campaign_run import CampaignResult
from sitl.lab.campaigns.case_flights import CaseAircraft, FlownCase
from sitl.lab.campaigns.number_expressions import NumberWalker
from sitl.lab.campaigns.specification import draw, load_specification
from sitl.lab.studies import spec_studies
from sitl.lab.studies.seeded_flights import Craft
from sitl.lab.studies.spec_studies import campaign_command, craft_changes, failing_pairs
from sitl.lab.studies.wrong_models import NOISES, noisier
from sitl.model.airframe_files import load
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.situation import hovers_again
from sitl.supervisor.guards import LYAPUNOV_PATIENCE
from tests.support.campaigns import failing, shipped
from tests.support.flights.tunings import BY_REPORT

ON_CAPTURE = Craft(navigation=Navigation.MOCAP)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["holds", "--wind", "40"], "--wind 40 is not within 0 and 30"),
        (["holds", "--gusts", "-1"], "--gusts -1 is not within 0 and 10"),
        (["holds", "--flights", "0"], "--flights 0: there must be at least 1"),
        (["holds", "--first", "-3"], "--first -3: seeds are not negative"),
        (["holds", "--parameters", "0.6"], "--parameters 0.6 is not within 0 and 0.5"),
        (["holds", "--json", "/nowhere/holds.json"], "/nowhere/holds.json: there is no folder /nowhere"),
        (["legs", "--wind", "40"], "--wind 40 is not within 0 and 30"),
        (["liveness", "--wind", "40"], "--wind 40 is not within 0 and 15"),
        (["margins", "--delay", "0.2"], "--delay 0.2 is not within 0 and 0.1"),
        (["margins", "--delay", "0.01", "-0.01"], "--delay -0.01 is not within 0 and 0.1"),
        (["margins", "--noise", "101"], "--noise 101 is not within 0 and 100"),
        (["margins", "--sensors", "/nowhere/own.toml"], "/nowhere/own.toml: No such file"),
        (["failures", "--units", "wing"], "--units wing: there are gyroscope, accelerometer"),
        (["failures", "--nav", "truth"], "--nav truth: a vehicle that sees the truth has no instruments"),
        (["failures", "--nav", "mocap", "--units", "gnss"], "--units gnss: there are gyroscope"),
        (["failures", "--phases", "taxi"], "--phases taxi: there are hover, transition"),
        (["failures", "--failures", "tired"], "--failures tired: there are off, stuck"),
        (["failures", "--units", "motor", "--failures", "drifting"], "--failures drifting: motor cannot fail so"),
    ],
)
def test_bad_arguments_are_refused_before_any_flight(arguments, message, capsys):
    assert main(["study", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert len(said.splitlines()) == 1


@pytest.fixture
def flown(monkeypatch):
    """Specifications that a study has flown; in each case every judgement holds but those that the test lets fail."""
    asked, failing_cases = [], {}

    def run(specification, jobs):
        asked.append(specification)
        cases = []
        for number in range(specification.cases):
            lost = failing_cases.get("lost", lambda _: ())(draw(specification, number))
            cases.append(
                FlownCase(number, "time", "", tuple(float(name not in lost) for name in specification.measures))
            )
        return CampaignResult(specification, cases, ended_early=False)

    monkeypatch.setattr(spec_studies, "run_in_memory", run)
    return asked, failing_cases


def test_options_are_values_of_the_file(flown, tmp_path):
    (tmp_path / "mine.toml").write_text(
        '[set]\nname = "mine"\nbase = "collage"\ndescription = "heavier"\n'
        '[m]\nvalue = 0.6\nunit = "kg"\nsource = "a test"\n'
    )
    arguments = ["--wind", "0", "4", "--gusts", "0.5", "--parameters", "0.2", "--first", "7", "--flights", "3"]
    craft = ["--airframe", str(tmp_path / "mine.toml"), "--nav", "mocap", "--controller", "indi", "--brisk"]
    assert main(["study", "holds", *arguments, *craft]) == 0
    (asked,) = flown[0]
    assert (asked.seed, asked.cases, asked.grid) == (7, 6, {"wind": (0.0, 4.0)})
    assert (asked.flight.parameters["SIM_GUST_RMS"], asked.airframe_draw.relative) == (0.5, 0.2)
    assert (asked.flight.vehicle.controller, asked.flight.vehicle.navigation) == ("indi", "mocap")
    assert asked.flight.parameters["DRK_PACE"] == 1.0
    assert asked.files.airframe.m == 0.6


def test_a_case_that_misses_what_is_required_is_the_exit_code_and_named_with_its_command(flown, capsys):
    flown[1]["lost"] = lambda case: (
        ("reached",) if case.values["law"] == "ALIGN" and case.values["goal"] == "stop" else ()
    )
    assert main(["study", "liveness", "--wind", "2"]) == 1
    said = capsys.readouterr().out
    assert "not reached: seed 1, law ALIGN, goal stop: darko-sitl campaign liveness --set" in said
    assert said.rstrip().endswith("--set 'vary.wind.grid=[2.0]' --case 12")
    assert "reached: 54 of 55" in said


def test_holds_are_near_for_most_of_the_time_in_each_wind(flown):
    flown[1]["lost"] = lambda case: ("near",) if case.values["wind"] == 8.0 and case.seed == 3 else ()
    assert main(["study", "holds", "--flights", "20"]) == 0
    assert main(["study", "holds", "--flights", "19"]) == 1


@pytest.mark.parametrize(("crashes", "code"), [(1, 0), (2, 1)])
def test_crashes_in_more_than_one_of_twenty_are_an_exit_code_however_many_others_are_flown(crashes, code, flown):
    flown[1]["lost"] = lambda case: ("spared",) if case.values["phase"] == "hover" and case.seed <= crashes else ()
    arguments = ["--units", "motor", "--failures", "off", "--phases", "hover", "cruise", "--flights", "20"]
    assert main(["study", "failures", *arguments]) == code


def test_margins_ask_for_forty_milliseconds_or_thirty_that_the_vehicle_does_not_know(flown):
    few = ["study", "margins", "--flights", "1", "--nav", "mocap", "--noise", "1", "4"]
    assert main([*few, "--delay", "0", "0.06"]) == 0
    assert main([*few, "--untold", "--controller", "report"]) == 0
    indi, report = flown[0]
    assert indi.grid == {"flown": ("hover", "leg"), "noise": (1.0, 4.0), "delay": (0.0, 0.06)}
    assert report.grid["flown"] == ("linear hover", "zero-moment hover", "leg")
    assert (indi.derived["survived"], indi.flight.vehicle.told) == ("0.04", True)
    assert (report.derived["survived"], report.flight.vehicle.told) == ("0.03", False)


def test_every_case_is_written(tmp_path, capsys):
    path = tmp_path / "holds.json"
    arguments = ["--nav", "truth", "--wind", "0", "--gusts", "0", "--flights", "1", "--jobs", "1", "--json", str(path)]
    assert main(["study", "holds", *arguments]) == 0
    assert "| 0 | 1 |" in capsys.readouterr().out
    (written,) = json.loads(path.read_text())
    assert (written["seed"], written["wind"], written["flown"], written["end"]) == (1, 0.0, True, "time")
    assert written["farthest"] < 0.01


# Holds.


@pytest.mark.long
def test_a_gusty_wind_moves_it_and_it_stays_near():
    """Four times what was measured: 0.3 m in the median of twenty seeds."""
    found = shipped("holds", {"vary.wind.grid": [5.0]}).measures
    assert 0.05 < found["across"] < 1.5
    assert found["above"] < 1.0


@pytest.mark.long
@pytest.mark.parametrize("navigation", [Navigation.MOCAP, Navigation.SENSORS])
def test_the_aircraft_that_was_built_holds_its_point_in_wind(navigation):
    """Its propellers turn at twice the speed of the default set's, and shake its instruments no more."""
    air = {"vary.wind.grid": [5.0], "parameters.SIM_GUST_RMS": 0.5, "flight.seconds": 40.0}
    found = shipped("holds", air, craft=Craft("darko", navigation)).measures
    assert (found["flown"], found["farthest"] < 1.0, found["highest"] < 1.0) == (1, True, True)


# Margins.


def test_only_the_noise_grows_and_the_pipeline_is_slowed():
    before, after = load_sensors(), noisier(load_sensors(), 4.0, 0.03)
    assert after.pipeline.latency == 0.03
    for name, part in before._asdict().items():
        if name != "pipeline":
            wanted = {key: 4.0 * value if key in NOISES else value for key, value in part._asdict().items()}
            assert getattr(after, name)._asdict() == wanted, name
    changed = {key for part in before for key in part._fields if key in NOISES}
    assert changed == set(NOISES)


def late(flown, delay=0.0, noise=1.0):
    vary = {"vary.flown.grid": [flown], "vary.noise.grid": [noise], "vary.delay.grid": [delay]}
    return shipped("delays", vary, craft=ON_CAPTURE).measures


@pytest.mark.parametrize("hover", ["linear hover", "zero-moment hover"])
def test_a_hover_on_time_converges(hover):
    found = late(hover)
    assert found["converged"]
    assert found["error"] < 0.1


def test_noise_makes_the_elevons_busier():
    assert late("zero-moment hover", noise=8.0)["activity"] > 1.5 * late("zero-moment hover")["activity"]


def test_a_vehicle_that_knows_everything_far_too_late_is_lost():
    """A tenth of a second is what can be asked for, and more than the attitude loop bears."""
    found = late("linear hover", delay=0.1)
    assert (found["converged"], found["needed"]) == (0, 1)


def test_what_is_not_told_changes_the_actuators_and_not_the_gains():
    def made(delay, *, told):
        changes = {"vary.delay.grid": [delay], "vary.flown.grid": ["leg"], "vehicle.told": told}
        specification = load_specification("delays", {**changes, **craft_changes(Craft())})
        return CaseAircraft(specification, draw(specification, 0)).vehicle

    known, unknown, none = made(0.03, told=True), made(0.03, told=False), made(0.0, told=True)
    gains = [vehicle.design.gains.line_of_sight.attitude.x for vehicle in (known, unknown, none)]
    assert gains[0] < gains[1] == gains[2]
    late = [float(v.avionics.instruments.specification.pipeline.latency) for v in (known, unknown, none)]
    assert late == [0.03, 0.03, 0.0]


# Liveness.


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


# Failures.


def test_units_aboard_go_by_navigation():
    on_satellites, on_capture = failing_pairs(Navigation.SENSORS), failing_pairs(Navigation.MOCAP)
    assert {"gnss", "magnetometer", "barometer"} == on_satellites.keys() - on_capture.keys()
    assert on_capture.keys() - on_satellites.keys() == {"mocap"}
    assert all(any(failure == "off" for _, failure in pairs) for name, pairs in on_capture.items() if name != "nothing")


def failed(unit, failure, phase, seed=1, **changes):
    return shipped("failures", {**failing(unit, failure, phase), **changes}, seed=seed)


def test_a_motor_that_is_off_is_noticed_and_the_vehicle_comes_down_with_motors_off():
    found = failed("motor", "off", "hover").measures
    assert (found["motors_off"], found["hit"]) == (1, 0)
    assert found["noticed"] < 10.0
    assert found["hit_at"] > 5.0


@pytest.mark.long
def test_in_cruise_a_magnetometer_that_is_stuck_is_noticed_and_changes_nothing():
    flight = failed("mag", "stuck", "cruise")
    assert flight.end == "time"
    assert flight.measures["noticed"] < 5.0
    assert flight.measures["believed_off"] < 2.0


@pytest.mark.long
def test_a_pitot_that_reads_six_too_much_is_flown_without():
    flight = failed("airspeed", "wrong", "transition")
    assert (flight.end, flight.measures["stayed"]) == ("time", 1)
    assert flight.measures["off"] < 10.0
    assert flight.measures["noticed"] < 60.0


@pytest.mark.long
@pytest.mark.parametrize(
    ("unit", "failure", "phase", "seed"),
    [
        ("gyro", "wrong", "back transition", 6),  # 97 m off while field and satellites were refused for long
        ("gyro", "drifting", "return", 6),  # 110 m off where the doubt of it ended too soon
        ("gyro", "scaled", "transition", 5),  # 121 m off while the accelerometer was doubted for it
        ("accel", "delayed", "back transition", 14),  # 70 m off while the attitude was doubted for it
        ("accel", "stuck", "transition", 17),  # 197 m off in a wind that nothing told any more
    ],
)
def test_an_inertial_instrument_that_misleads_is_flown_without(unit, failure, phase, seed):
    found = failed(unit, failure, phase, seed).measures
    assert (found["motors_off"], found["hit"], found["stayed"]) == (0, 0, 1)
    assert found["off"] < 15.0
    assert found["noticed"] >= 0.0


@pytest.mark.long
def test_without_a_position_it_is_down_before_it_is_far_away():
    found = failed("gps", "stuck", "hover", 14).measures
    assert (found["came_down"], found["stayed"]) == (1, 1)
    assert found["off"] < 60.0  # m; with a healthy vehicle's patience it hovered on, 67 m away


@pytest.mark.parametrize(
    ("phase", "seed", "air"),
    [
        ("back transition", 1, {}),
        pytest.param(
            "return", 17, {"vary.wind.uniform": [0.0, 12.0], "parameters.SIM_GUST_RMS": 2.0}, marks=pytest.mark.long
        ),  # an updraught far above the ground is no touch-down
    ],
)
def test_nothing_that_fails_raises_no_alarm(phase, seed, air):
    flight = failed("battery", "healthy", phase, seed, **air)
    assert (flight.end, flight.measures["noticed"] >= 0.0) == ("time", False)


@pytest.mark.parametrize(
    ("told", "away"),
    [
        ({"warned": 9.0}, False),
        ({}, False),  # cut without a word is still no crash
        ({"hit": 1.0, "warned": 9.0}, False),
        ({"hit": 1.0}, True),
        ({"off": 30.0, "forward": 1.0}, False),
        ({"off": 30.1}, True),
        ({"off": 30.1, "warned": 9.0}, False),
        ({"off": 30.1, "warned": 9.0, "forward": 1.0}, True),
        ({"off": 60.1, "warned": 9.0}, True),
    ],
)
def test_a_flight_is_judged_by_the_truth_against_its_plan(told, away):
    names = {"hit": 0.0, "warned": float("nan"), "off": 1.5, "forward": 0.0, **told}
    judged = load_specification("failures").measures["flew_away"].text
    assert NumberWalker(names).number(judged) == away


def test_the_command_says_what_differs_from_the_file():
    same = {**craft_changes(Craft()), "vary.wind.grid": [3, 5, 8], "run.seed": 1}
    assert campaign_command("holds", same) == "darko-sitl campaign holds"
    changed = {**same, "vehicle.controller": "indi", "vary.wind.grid": [4.0], "run.seed": 7}
    sets = "--set vehicle.controller=indi --set 'vary.wind.grid=[4.0]' --set run.seed=7"
    assert campaign_command("holds", changed) == f"darko-sitl campaign holds {sets}"
