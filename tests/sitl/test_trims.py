"""Trims beyond level flight: braking, turning, and what of them the actuators can hold."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sitl.airframe import load
from sitl.commands import airframe as airframe_command
from sitl.design.trim import banked_trim, braking_limit, decelerating_trim, level_trim, turning_trim
from sitl.errors import SitlError
from sitl.kernels.integrate import plant_step
from sitl.kernels.quaternion import from_euler, multiply, rotate, rotate_inverse
from sitl.kernels.rigid_body import derivative
from sitl.kernels.state import ACTUATOR, ANCHOR, SIZE, Q, V, W
from sitl.studies.trims import cost, gaps

NOMINAL, PUBLISHED = load("nominal").parameters, load("published").parameters
ALOFT = (0.0, 0.0, 500.0)


def rates(state, a):
    """Linear and angular acceleration of the plant, (6,)."""
    dx = np.empty(ACTUATOR)
    derivative(state, np.full(SIZE, math.nan), np.zeros(3), a, dx)
    return np.concatenate((dx[V : V + 3], dx[W:]))


def straight(trim):
    """The plant's state in a straight trim, heading north."""
    v = trim.speed * math.cos(trim.climb), 0.0, trim.speed * math.sin(trim.climb)
    q = math.cos(trim.theta / 2), 0.0, -math.sin(trim.theta / 2), 0.0
    return np.array((*ALOFT, *v, *q, 0.0, 0.0, 0.0, trim.omega, trim.omega, trim.delta, trim.delta))


# Braking


@settings(deadline=None, max_examples=60)
@given(st.floats(0, 25), st.floats(-5, 5), st.floats(-0.4, 0.9), st.sampled_from([NOMINAL, PUBLISHED]))
def test_the_plant_accelerates_along_the_path_as_asked_and_does_not_turn(speed, accel, climb, a):
    trim = decelerating_trim(a, speed, accel, climb)
    assume(trim.thrust >= 0.0 and math.isfinite(trim.delta))
    expected = accel * math.cos(climb), 0.0, accel * math.sin(climb), 0.0, 0.0, 0.0
    assert rates(straight(trim), a) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize(
    ("speed", "degrees"),
    [
        (4, (22.3, 24.4, 26.3, 27.9)),
        (5, (26.8, 29.9, 33.2, 36.8)),
        (6, (27.1, 30.3, 34.1, 38.4)),
        (7, (24.8, 27.5, 30.7, 34.3)),
        (8, (21.5, 23.6, 25.9, 28.6)),
        (10, (15.5, 16.6, 17.7, 19.0)),
    ],
)
def test_braking_needs_elevon_and_most_of_all_in_the_pitch_corridor(speed, degrees):
    needed = [math.degrees(decelerating_trim(NOMINAL, speed, -accel).delta) for accel in range(4)]
    assert needed == pytest.approx(degrees, abs=0.06)


def test_accelerating_through_the_corridor_is_easy():
    assert math.degrees(decelerating_trim(NOMINAL, 6.0, 3.0).delta) == pytest.approx(19.7, abs=0.05)


def test_the_braking_limit_is_where_the_reserve_is_all_that_is_left():
    speeds, reserve = np.array([4.0, 5.5, 7.0, 9.0]), math.radians(1.0)
    limit = braking_limit(NOMINAL, speeds, 0.0, reserve)
    for speed, most in zip(speeds, limit.elevons, strict=True):
        assert decelerating_trim(NOMINAL, speed, -most).margin == pytest.approx(reserve, abs=1e-6)
    assert limit.elevons.argmin() == 1
    assert (limit.elevons < braking_limit(NOMINAL, speeds).elevons).all()


def test_fast_it_is_the_motors_that_limit_braking():
    limit = braking_limit(NOMINAL, 12.0)
    assert limit.held < limit.elevons
    assert decelerating_trim(NOMINAL, 12.0, -float(limit.held)).motor_margin == pytest.approx(0.0, abs=1e-5)


def test_climbing_helps_braking_and_descending_forbids_it():
    climbs = np.radians([-15.0, 0.0, 15.0])
    descending, level, climbing = braking_limit(NOMINAL, 6.0, climbs).held
    assert descending < 0.0 < level < climbing


def test_where_nothing_trims_the_limit_is_an_acceleration():
    """The published set cannot fly at 7 m/s; gaining speed it can pass it."""
    limit = braking_limit(PUBLISHED, 7.0).held
    assert limit < -1.0
    assert decelerating_trim(PUBLISHED, 7.0, -float(limit)).margin == pytest.approx(0.0, abs=1e-6)


def test_a_table_of_limits_is_its_entries():
    speeds, climbs = np.linspace(0.0, 25.0, 6), np.array([[0.0], [0.3]])
    table = braking_limit(NOMINAL, speeds, climbs, 0.02).held
    one = [[float(braking_limit(NOMINAL, v, float(g[0]), 0.02).held) for v in speeds] for g in climbs]
    assert table == pytest.approx(np.array(one), abs=1e-9)


def test_a_reserve_beyond_the_elevons_leaves_no_limit():
    assert math.isnan(braking_limit(NOMINAL, 10.0, 0.0, 1.0).held)
    assert level_trim(NOMINAL, 10.0).exists


# Turning


def turning(trim):
    """The plant's state in a turn, at the moment at which it flies north."""
    v = trim.speed * math.cos(trim.climb), 0.0, trim.speed * math.sin(trim.climb)
    return np.array((*ALOFT, *v, *trim.q, *trim.rates, *trim.omega, *trim.delta))


TURNS = [
    (0.0, 60.0, 0.0), (1.0, -30.0, 0.0), (5.5, 45.0, 0.0), (8.0, 30.0, 20.0), (8.0, 20.0, -20.0),
    (12.0, -45.0, 45.0), (20.0, 60.0, 0.0), (25.0, 10.0, -5.0),
]  # fmt: skip


@pytest.mark.parametrize(("speed", "turn", "climb"), TURNS)
def test_in_a_turn_the_plant_only_follows_the_circle(speed, turn, climb):
    trim = turning_trim(NOMINAL, speed, math.radians(turn), math.radians(climb))
    sideways = trim.turn_rate * speed * math.cos(trim.climb)
    assert rates(turning(trim), NOMINAL) == pytest.approx((0.0, sideways, 0.0, 0.0, 0.0, 0.0), abs=1e-8)
    v_b = rotate_inverse(trim.q, turning(trim)[V : V + 3])
    assert v_b[1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("speed", "turn", "climb"), TURNS)
def test_flown_open_loop_a_turn_keeps_its_speed_climb_and_rates(speed, turn, climb):
    trim = turning_trim(NOMINAL, speed, math.radians(turn), math.radians(climb))
    plant = np.concatenate((turning(trim), np.full(SIZE - ANCHOR, math.nan)))
    command, calm, v = np.concatenate((trim.omega, trim.delta)), np.zeros(3), plant[V : V + 3].copy()
    for _ in range(200):
        plant_step(plant, command, calm, True, NOMINAL, 0.001)
    turned = from_euler(0.0, 0.0, 0.2 * trim.turn_rate)
    assert plant[V : V + 3] == pytest.approx(rotate(turned, v), abs=1e-7)
    assert plant[Q : Q + 4] == pytest.approx(multiply(turned, trim.q), abs=1e-7)
    assert plant[W : W + 3] == pytest.approx(trim.rates, abs=1e-7)


@settings(deadline=None, max_examples=15)
@given(st.floats(0, 25), st.floats(0.05, 0.8), st.floats(-0.2, 0.7))
def test_right_is_left_seen_in_the_mirror(speed, turn_rate, climb):
    left, right = (turning_trim(NOMINAL, speed, sign * turn_rate, climb) for sign in (1.0, -1.0))
    assert right.delta == pytest.approx(left.delta[::-1], abs=1e-7, nan_ok=True)
    assert right.omega == pytest.approx(left.omega[::-1], abs=1e-5, nan_ok=True)
    assert (right.margin, right.bank) == pytest.approx((left.margin, -left.bank), abs=1e-7, nan_ok=True)


@pytest.mark.parametrize("climb", [0.0, 0.5])
def test_not_turning_is_flying_straight(climb):
    straight_on, turn = level_trim(NOMINAL, 9.0, climb), turning_trim(NOMINAL, 9.0, 0.0, climb)
    assert turn.theta == pytest.approx(straight_on.theta)
    assert (*turn.omega, *turn.delta) == pytest.approx(2 * (straight_on.omega,) + 2 * (straight_on.delta,))
    assert (turn.margin, turn.motor_margin) == pytest.approx((straight_on.margin, straight_on.motor_margin))


def test_a_bank_and_its_turn_rate_are_the_same_turn():
    rate = turning_trim(NOMINAL, 12.0, 0.5, 0.1)
    bank = banked_trim(NOMINAL, 12.0, rate.bank, 0.1)
    assert bank.turn_rate == pytest.approx(0.5)
    assert bank.delta == pytest.approx(rate.delta)
    assert math.tan(rate.bank) == pytest.approx(0.5 * 12.0 * math.cos(0.1) / 9.81, rel=0.1)  # nearly any aeroplane's


def test_the_margin_of_a_turn_is_that_of_its_worse_side():
    """Turning left the right wing is faster: its elevon and its motor do more."""
    trim = turning_trim(NOMINAL, 5.5, 0.8)
    assert trim.exists
    assert trim.delta[1] > trim.delta[0]
    assert trim.omega[1] > trim.omega[0]
    assert trim.margin == NOMINAL.delta_max - trim.delta[1]


def test_what_the_elevons_or_the_motors_cannot_hold_does_not_exist():
    assert banked_trim(PUBLISHED, 7.0, math.radians(30.0)).margin < 0.0
    tight = banked_trim(NOMINAL, 15.0, math.radians(75.0))
    assert tight.motor_margin < 0.0 < tight.margin
    assert not tight.exists
    dive = turning_trim(NOMINAL, 20.0, 0.3, -0.4)  # the propellers would have to push
    assert math.isnan(dive.margin)
    assert not dive.exists


# The page and the table


def test_gaps_are_said_as_ranges():
    speeds = np.arange(0.0, 26.0)
    assert gaps(speeds, [level_trim(NOMINAL, v) for v in speeds]) == ""
    assert gaps(speeds, [level_trim(PUBLISHED, v) for v in speeds]) == "none at 6-9 m/s"
    assert gaps(speeds[6:9], [level_trim(PUBLISHED, v) for v in speeds[6:9]]) == "none"
    descent = [level_trim(NOMINAL, v, math.radians(-15.0)) for v in speeds]
    assert gaps(speeds, descent) == "none at 5-7, 13-25 m/s"


def test_slow_flight_costs_most_and_25_metres_per_second_least():
    costs = [cost(NOMINAL, level_trim(NOMINAL, v)) for v in (5.0, 10.0, 15.0, 20.0, 25.0)]
    assert costs == pytest.approx([29.0, 5.40, 1.56, 0.86, 0.73], rel=0.01)
    assert cost(NOMINAL, level_trim(NOMINAL, 0.0)) == math.inf
    turn = turning_trim(NOMINAL, 15.0, 0.5)
    assert cost(NOMINAL, turn) > costs[2]


def run(*arguments):
    return airframe_command.run(airframe_command.parser({"airframe": ""}).parse_args(arguments))


def test_the_table_says_where_there_is_no_trim(capsys):
    run("nominal", "--trims", "--climb", "-15")
    lines = capsys.readouterr().out.splitlines()
    assert [int(line.split()[0]) for line in lines[1:] if "none" in line] == [5, 6, 7, *range(13, 26)]


def test_a_turn_s_table_has_both_sides(capsys):
    run("nominal", "--trims", "--turn", "30")
    row = capsys.readouterr().out.splitlines()[6].split()
    assert row[:2] == ["5", "30.0"]
    assert float(row[4]) < float(row[5])
    run("nominal", "--trims", "--bank", "30")
    assert float(capsys.readouterr().out.splitlines()[1].split()[2]) == 30.0


def test_the_plot_is_written_or_said_not_to_be(tmp_path, capsys):
    run("published", "--trims", "--plot", str(tmp_path / "trims.png"))
    assert (tmp_path / "trims.png").stat().st_size > 50_000
    with pytest.raises(SitlError, match=r"plot .*nosuch"):
        run("published", "--trims", "--plot", str(tmp_path / "nosuch" / "trims.png"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nominal", "--trims", "--climb", "90"), "--climb 90 is not within"),
        (("nominal", "--trims", "--bank", "nan"), "--bank nan is not within"),
        (("nominal", "--turn", "10"), "--turn goes with"),
        (("--trims", "--climb", "10"), "--climb goes with"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments, words):
    with pytest.raises(SitlError, match=words):
        run(*arguments)
