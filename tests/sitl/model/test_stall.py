"""Aerodynamics that take energy: a still wing never gains any, it stalls, and its slipstream part stays attached."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sitl.design.trim import trims
from sitl.model import aerodynamics, phi_theory, stall
from sitl.model.airframe import PASSIVE, REPORT, STALL, elevon_arm, slipstream_slope
from sitl.model.airframe_files import AirframeError, load, passive_loss
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, dot, subtract
from tests.support.flights.plant_flight import actuators

SETS = {name: load(name).parameters for name in ("nominal", "passive", "collage", "darko")}
COLLAGE, DARKO = SETS["collage"], SETS["darko"]
STILL = Vector(0.0, 0.0, 0.0)
velocities = st.builds(Vector, *[st.floats(-40.0, 40.0)] * 3)
rates = st.builds(Vector, *[st.floats(-15.0, 15.0)] * 3)
elevons = st.floats(-0.7, 0.7)


def gained(v, w, left, right, a):
    """Power that still air gives the wing, the motors stopped [W]."""
    F, M = aerodynamics.wrench(v, w, Actuators(0.0, 0.0, left, right), a)
    return dot(F, v) + dot(M, w)


@pytest.mark.long
@settings(max_examples=400)
@given(v=velocities, w=rates, left=elevons, right=elevons)
@pytest.mark.parametrize("name", ["passive", "collage", "darko"])
def test_a_still_wing_never_gains_energy(name, v, w, left, right):
    assert gained(v, w, left, right, SETS[name]) <= 1e-9


@given(v=velocities, w=rates, left=elevons, right=elevons)
def test_what_the_passive_wing_loses_is_a_form_of_motion_and_elevons(v, w, left, right):
    """Positive semidefinite, so that it gains energy in no state, not only in none that was drawn."""
    a = SETS["passive"]
    h = 0.5 * a.rho * a.S * phi_theory.effective_speed(v, w, a)
    x = np.array([left * v.x, right * v.x, *v, *w])
    assert gained(v, w, left, right, a) == pytest.approx(-h * (x @ passive_loss(a) @ x), rel=1e-9, abs=1e-9)
    assert np.linalg.eigvalsh(passive_loss(a)).min() > -1e-12


def test_the_reports_roll_damping_beside_opposed_elevons_gains_energy():
    a = SETS["passive"]._replace(C_lp=SETS["nominal"].C_lp)
    assert np.linalg.eigvalsh(passive_loss(a)).min() < -1e-3
    assert gained(Vector(4.0, 0.0, 0.0), Vector(-16.0, 0.0, 25.0), 0.3, -0.3, a) > 0.1


def test_the_reports_wing_gains_energy():
    random = np.random.default_rng(1)
    most = max(
        gained(Vector(*random.uniform(-15, 15, 3)), Vector(*random.uniform(-8, 8, 3)), 0.0, 0.0, SETS["nominal"])
        for _ in range(3000)
    )
    assert most > 5.0


@given(v=velocities, w=rates, left=elevons, right=elevons, speed=st.floats(0.0, 900.0))
@pytest.mark.parametrize("name", list(SETS))
def test_the_normal_force_alone_is_the_wrench_s_to_the_bit(name, v, w, left, right, speed):
    asked = (v, w, Actuators(speed, 0.9 * speed, left, right), SETS[name])
    assert aerodynamics.normal_force(*asked) == aerodynamics.wrench(*asked)[0].z


def test_the_sets_name_their_level():
    assert [SETS[name].aerodynamics for name in ("nominal", "passive", "collage")] == [REPORT, PASSIVE, STALL]


def test_without_rates_and_elevons_passive_is_the_reports():
    a = SETS["passive"]
    v, still = Vector(9.0, 1.0, -2.0), actuators((500.0, 600.0, 0.0, 0.0))
    for mended, printed in zip(
        phi_theory.passive_wrench(v, STILL, still, a), phi_theory.wrench(v, STILL, still, a), strict=True
    ):
        assert mended == pytest.approx(printed)


def test_an_elevon_has_drag_in_passive():
    a, v = SETS["passive"], Vector(15.0, 0.0, 0.0)
    bent = Actuators(0.0, 0.0, 0.3, 0.3)
    less = phi_theory.passive_wrench(v, STILL, bent, a)[0].x - phi_theory.wrench(v, STILL, bent, a)[0].x
    assert less == pytest.approx(-0.5 * a.rho * a.S * 15.0**2 * 0.5 * a.C_l * a.xi_f * 2 * 0.09)


def test_a_damping_that_gives_energy_is_refused_where_energy_counts(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        '[set]\nname = "mine"\ndescription = "x"\nbase = "nominal"\n'
        '[aerodynamics]\nvalue = "passive"\nunit = "name"\nsource = "x"\n'
    )
    with pytest.raises(AirframeError, match=r"C_nr = 0\.0039.*the wing gains energy"):
        load(str(path))


def normal_coefficient(incidence, motors=0.0):
    """C_N of the whole wing, motors at a speed [rad/s]."""
    v = Vector(10.0 * math.cos(incidence), 0.0, -10.0 * math.sin(incidence))
    a = COLLAGE._replace(k_fv=0.0, k_fvv=0.0)
    F, _ = stall.wrench(v, STILL, Actuators(motors, motors, 0.0, 0.0), a)
    return F.z / (0.5 * a.rho * a.S * 100.0)


def test_it_is_attached_at_small_incidence_and_a_flat_plate_across_the_stream():
    assert normal_coefficient(math.radians(2.0)) == pytest.approx(COLLAGE.C_l * math.sin(math.radians(2.0)), rel=0.01)
    assert normal_coefficient(math.pi / 2) == pytest.approx(COLLAGE.C_90, rel=0.05)
    rise = [normal_coefficient(math.radians(angle)) for angle in (10.0, 15.0, 20.0, 30.0, 45.0)]
    assert max(rise) < 1.1  # less than a third of the linear wing's at 45 deg
    assert rise[1] > rise[0]


def test_the_slipstream_keeps_its_part_attached():
    """At 60 deg of incidence the stalled wing carries a third more with its motors on."""
    assert normal_coefficient(math.radians(60.0), 600.0) > 1.3 * normal_coefficient(math.radians(60.0))


def test_at_rest_the_elevons_force_is_the_reports():
    a = COLLAGE
    for delta in (0.05, -0.1):
        T = a.k_f * 600.0**2
        F, M = stall.wrench(STILL, STILL, Actuators(600.0, 600.0, delta, delta), a)
        force = -2.0 * a.S_ratio * a.C_l * a.xi_f * T * delta
        assert F.z == pytest.approx(force, rel=0.02)
        assert M.y == pytest.approx(force * elevon_arm(a), rel=0.02)


@given(v=st.builds(Vector, st.floats(0.5, 20.0), st.floats(-3.0, 3.0), st.floats(-8.0, 8.0)), w=st.floats(0.0, 800.0))
@pytest.mark.parametrize("name", list(SETS))
def test_the_slopes_are_those_of_the_wrench(name, v, w):
    """Normal force, its moment and the elevons' effect, about zero deflection and rates; of the thrust without k_fc."""
    a = SETS[name]._replace(k_fc=0.0)
    if a.swirl > 0.0:  # where a thrust has one speed, and air across the wing something to be divided by
        w += 500.0
        assume(abs(v.z) > stall.LEAST_ACROSS)
    T1, T2 = aerodynamics.thrusts(Actuators(w, w, 0.0, 0.0), v.x, a)
    found, h = aerodynamics.slopes(v, T1, T2, a), 1e-6
    F, M = aerodynamics.wrench(v, STILL, Actuators(w, w, 0.0, 0.0), a)
    assert F.z == pytest.approx(-found.normal * v.z, abs=1e-9)
    assert M.y == pytest.approx(-found.moment * v.z, abs=1e-9)
    bent, _ = aerodynamics.wrench(v, STILL, Actuators(w, w, h, 0.0), a)
    assert (F.z - bent.z) / h == pytest.approx(found.left_elevon, rel=1e-3, abs=1e-3)


def test_level_flight_has_a_trim_with_margins_at_every_speed():
    level = trims(COLLAGE, np.arange(0.0, 25.5, 0.5))
    assert all(trim.exists for trim in level)
    assert min(trim.margin for trim in level) > math.radians(5.0)
    assert min(trim.motor_margin for trim in level) > 100.0


def test_a_trim_leaves_nothing_over():
    for trim in trims(COLLAGE, np.array((0.0, 4.0, 9.0, 15.0)), 0.1):
        v = Vector(trim.speed * math.cos(trim.theta - trim.climb), 0.0, -trim.speed * math.sin(trim.theta - trim.climb))
        F, M = aerodynamics.wrench(v, STILL, Actuators(trim.omega, trim.omega, trim.delta, trim.delta), COLLAGE)
        weight = COLLAGE.m * COLLAGE.g
        assert F.x == pytest.approx(weight * math.sin(trim.theta), abs=5e-3)
        assert F.z == pytest.approx(weight * math.cos(trim.theta), abs=5e-3)
        assert pytest.approx((0.0, 0.0, 0.0), abs=1e-4) == M


def test_rotors_turn_the_pitch_rate_into_yaw():
    """Gyroscopic moment of unequal propellers."""
    pitching = Vector(0.0, 3.0, 0.0)
    fast = Actuators(800.0, 400.0, 0.0, 0.0)
    with_rotors = stall.wrench(STILL, pitching, fast, COLLAGE)[1]
    without = stall.wrench(STILL, pitching, fast, COLLAGE._replace(J_p=0.0))[1]
    assert with_rotors.z - without.z == pytest.approx(-3.0 * COLLAGE.J_p * 400.0)


@pytest.mark.parametrize("speed", [3.0, 15.0])
def test_the_drag_of_the_free_stream_is_the_wrench_s_where_no_slipstream_is(speed):
    a = COLLAGE._replace(S_ratio=0.0, k_fv=0.0, k_fvv=0.0)
    v = Vector(speed, 0.0, 0.0)
    F, _ = stall.wrench(v, STILL, Actuators(0.0, 0.0, 0.0, 0.0), a)
    assert aerodynamics.slopes(v, 0.0, 0.0, a).drag * speed == pytest.approx(-F.x)


@pytest.mark.parametrize(("incidence", "detached"), [(0.5, 0.0), (90.0, 1.0)])
def test_the_centre_of_pressure_moves_back_as_the_flow_detaches(incidence, detached):
    angle = math.radians(incidence)
    v = Vector(10.0 * math.cos(angle), 0.0, -10.0 * math.sin(angle))
    a = COLLAGE._replace(k_fv=0.0, k_fvv=0.0, cp_shift=0.02, slip_shift=0.02, per_stall=100.0)
    F, M = stall.wrench(v, STILL, Actuators(0.0, 0.0, 0.0, 0.0), a)
    behind = a.Delta_r + detached * a.cp_shift  # of wing and elevon alike; the elevon's hinge does not move
    assert M.y / F.z == pytest.approx(behind - detached * a.xi_f * a.cp_shift, rel=1e-3)


def across(a, speed, wind):
    """Force along z_b of a hovering wing in air from its belly's side [N]."""
    return stall.wrench(Vector(0.0, 0.0, -wind), STILL, Actuators(speed, speed, 0.0, 0.0), a)[0].z


def test_a_slipstream_that_swirls_feels_little_air_across_it_until_that_fills_one_half():
    a, speed = DARKO._replace(k_h=0.0, k_fc=0.0, blown_share=1.0, S=2.0 * DARKO.S_ratio * DARKO.S_p), 1280.0
    still = a._replace(swirl=0.0)
    low, high = across(a, speed, 0.5) / 0.5, (across(a, speed, 5.0) - across(a, speed, 4.0)) / 1.0
    assert low < 0.35 * across(still, speed, 0.5) / 0.5
    assert high > 2.0 * low
    assert across(a, speed, 0.0) == pytest.approx(0.0, abs=1e-12)
    assert across(a, speed, -2.0) == pytest.approx(-across(a, speed, 2.0))


def test_without_thrust_nothing_swirls():
    v = Vector(12.0, 0.0, -3.0)
    a = DARKO._replace(k_fv=0.0, k_fvv=0.0, k_fw=0.0)
    for one, other in zip(
        stall.wrench(v, STILL, Actuators(0.0, 0.0, 0.1, 0.1), a),
        stall.wrench(v, STILL, Actuators(0.0, 0.0, 0.1, 0.1), a._replace(swirl=0.0)),
        strict=True,
    ):
        assert one == pytest.approx(other, abs=1e-12)


def test_the_elevons_slope_in_a_slipstream_at_rest_is_the_wrench_s():
    for a in (COLLAGE, DARKO):
        T, h = aerodynamics.thrusts(Actuators(700.0, 700.0, 0.0, 0.0), 0.0, a)[0], 1e-6
        bent = stall.wrench(STILL, STILL, Actuators(700.0, 700.0, h, h), a)[0]
        assert -bent.z / h == pytest.approx(2.0 * a.S_ratio * slipstream_slope(a) * a.xi_f * T, rel=1e-6)
    assert slipstream_slope(COLLAGE) == COLLAGE.C_l


@given(v=velocities, w=rates, left=st.floats(0.0, 1700.0), right=st.floats(0.0, 1700.0))
def test_air_across_the_propellers_takes_energy(v, w, left, right):
    act, bare = Actuators(left, right, 0.0, 0.0), DARKO._replace(k_h=0.0)
    (F, M), (F0, M0) = stall.wrench(v, w, act, DARKO), stall.wrench(v, w, act, bare)
    taken = dot(subtract(F, F0), v) + dot(subtract(M, M0), w)
    assert taken <= 1e-9 * (1.0 + dot(v, v) + dot(w, w))
    assert aerodynamics.side_force(v, act, DARKO) == pytest.approx(-DARKO.k_h * (left + right) * v.y)


def test_air_across_a_turning_propeller_gives_it_thrust_and_a_stopped_one_none():
    bare = DARKO._replace(k_fc=0.0)
    for speed, gained in ((1280.0, 2.0 * DARKO.k_fc * 9.0), (0.0, 0.0)):
        act = Actuators(speed, speed, 0.0, 0.0)
        aside = Vector(0.0, 3.0, 0.0)  # along the wing, which then feels the rest alike
        more = stall.wrench(aside, STILL, act, DARKO)[0].x - stall.wrench(aside, STILL, act, bare)[0].x
        assert more == pytest.approx(gained, rel=0.15, abs=1e-12)
