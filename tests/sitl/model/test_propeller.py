"""Propellers: energy, the measured table, and the report's law as the case without inflow."""

import math
import tomllib
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sitl.design.trim import level_trim
from sitl.model.airframe_files import available, load
from sitl.model.battery import battery_power, shaft_power
from sitl.model.propeller import hover_speed, speed_for, thrust, torque, torque_difference
from sitl.model.propeller_files import (
    MAX_MISFIT,
    PropellerError,
    available_propellers,
    load_propeller,
    propeller_of,
)
from sitl.model.state import Actuators

COLLAGE, NOMINAL, DARKO = (load(name).parameters for name in ("collage", "nominal", "darko"))
speeds = st.floats(0.0, 1500.0)  # [rad/s]
inflows = st.floats(-60.0, 60.0)  # [m/s]


@given(left=speeds, right=speeds, inflow=inflows)
@pytest.mark.parametrize("a", [COLLAGE, DARKO])
def test_no_state_gives_more_thrust_power_than_shaft_power_nor_that_more_than_the_battery(a, left, right, inflow):
    actuators = Actuators(left, right, 0.0, 0.0)
    pushed = inflow * (thrust(left, inflow, a) + thrust(right, inflow, a))
    turned = shaft_power(actuators, inflow, a)
    drawn = battery_power(actuators, inflow, a)
    assert pushed <= turned + 1e-9 * (1.0 + abs(turned))
    assert turned <= drawn
    assert drawn >= 0.0


def test_the_reports_law_breaks_that_in_its_own_level_flight():
    """Thrust and torque that do not know of the airspeed give more than they take from 18 m/s on."""
    ratio = {}
    for speed in (15.0, 18.0, 25.0):
        trim = level_trim(NOMINAL, speed)
        ahead = speed * math.cos(trim.theta)
        actuators = Actuators(trim.omega, trim.omega, 0.0, 0.0)
        ratio[speed] = 2.0 * trim.thrust * ahead / shaft_power(actuators, ahead, NOMINAL)
    assert ratio[15.0] < 1.0 < ratio[18.0] < ratio[25.0]


@given(speed=st.floats(100.0, 1500.0), inflow=inflows)
def test_without_terms_in_the_inflow_it_is_the_reports(speed, inflow):
    assert thrust(speed, inflow, NOMINAL) == NOMINAL.k_f * speed * speed
    assert torque(speed, inflow, NOMINAL) == NOMINAL.k_m * speed * speed


@given(wanted=st.floats(0.3, 6.0), inflow=st.floats(-4.0, 25.0))
def test_the_speed_for_a_thrust_gives_it(wanted, inflow):
    for airframe in (COLLAGE, NOMINAL, DARKO):
        assert thrust(speed_for(wanted, inflow, airframe), inflow, airframe) == pytest.approx(wanted)


def test_no_speed_gives_a_thrust_below_that_of_a_stopped_propeller():
    assert speed_for(-1.0, 0.0, COLLAGE) == 0.0
    assert speed_for(thrust(0.0, 10.0, COLLAGE), 10.0, COLLAGE) == pytest.approx(0.0, abs=1e-6)


@given(left=speeds, right=speeds, inflow=inflows)
def test_the_difference_of_the_torques_is_one(left, right, inflow):
    difference = torque(left, inflow, COLLAGE) - torque(right, inflow, COLLAGE)
    assert torque_difference(left, right, inflow, COLLAGE) == pytest.approx(difference, abs=1e-9)


def test_a_propeller_in_fast_air_brakes_and_is_turned_by_it():
    assert thrust(200.0, 20.0, COLLAGE) < 0.0
    assert torque(200.0, 20.0, COLLAGE) < 0.0
    assert battery_power(Actuators(200.0, 200.0, 0.0, 0.0), 20.0, COLLAGE) < 10.0  # no power goes back, nor much out


@pytest.mark.parametrize("name", available_propellers())
def test_the_fit_meets_every_row_of_the_table_and_names_its_source(name):
    propeller = load_propeller(name)
    J, C_T, C_P = propeller.table.T
    fitted_thrust, fitted_power = propeller.coefficients(J)
    assert np.abs(fitted_thrust - C_T).max() <= MAX_MISFIT
    assert np.abs(fitted_power - C_P).max() <= MAX_MISFIT
    assert propeller.source
    constants = propeller.constants(1.225)
    n, D, V = 100.0, propeller.diameter, 10.0
    C_T, C_P = propeller.coefficients(np.array([V / (n * D)]), n)
    mine = COLLAGE._replace(**constants)
    w = 2.0 * math.pi * n
    assert thrust(w, V, mine) == pytest.approx(1.225 * n**2 * D**4 * C_T[0])
    assert torque(w, V, mine) * w == pytest.approx(1.225 * n**3 * D**5 * C_P[0])


def raw():
    return tomllib.loads((files("sitl.model.propellers") / "apc-8x8e.toml").read_text())


def test_a_propeller_that_makes_energy_is_refused():
    table = raw()
    for rows in (table["measured"]["rows"], table["assumed"]["rows"]):
        for row in rows:
            row[2] *= 0.6
    with pytest.raises(PropellerError, match="more thrust power than shaft power at J = "):
        propeller_of("free", table)


def test_a_table_that_the_fit_does_not_meet_is_refused():
    table = raw()
    table["measured"]["rows"][3][1] += 0.05
    with pytest.raises(PropellerError, match=r"misses the table by 0\.0"):
        propeller_of("bent", table)


@pytest.mark.parametrize("damage", ["rows", "source"])
def test_a_table_without_a_part_is_refused_by_name(damage):
    table = raw()
    del table["measured"][damage]
    with pytest.raises(PropellerError, match=f"propeller half: not a table of J, C_T and C_P: '{damage}'"):
        propeller_of("half", table)


def test_an_unknown_propeller_is_refused_with_those_there_are():
    with pytest.raises(PropellerError, match="no propeller 'wood': there are apc-8x8e, t5147"):
        load_propeller("wood")


def test_the_motors_reach_their_greatest_speed_from_a_nearly_empty_battery():
    a, empty = COLLAGE, 9.9
    current = torque(a.omega_max, 0.0, a) / a.motor_constant + a.idle_current
    drawn = battery_power(Actuators(a.omega_max, a.omega_max, 0.0, 0.0), 0.0, a)
    left = empty - a.battery_resistance * drawn / empty
    assert a.motor_constant * a.omega_max + a.motor_resistance * current < left


@pytest.mark.parametrize("name", available())
def test_a_hover_draws_more_than_the_ideal_rotor_of_its_disc(name):
    a = load(name).parameters
    trim = level_trim(a, 0.0)
    ideal = 2.0 * trim.thrust * math.sqrt(trim.thrust / (2.0 * a.rho * a.S_p))
    assert shaft_power(Actuators(trim.omega, trim.omega, 0.0, 0.0), 0.0, a) > ideal


@given(left=speeds, right=speeds, inflow=st.floats(-5.0, 20.0))
def test_what_the_battery_gives_is_what_arrives_and_what_its_own_resistance_takes(left, right, inflow):
    actuators = Actuators(left, right, 0.0, 0.0)
    arrives = battery_power(actuators, inflow, COLLAGE._replace(battery_resistance=0.0))
    assume(arrives < 0.9 * COLLAGE.battery_voltage**2 / (4.0 * COLLAGE.battery_resistance))  # more is never there
    given_up = battery_power(actuators, inflow, COLLAGE)
    current = given_up / COLLAGE.battery_voltage
    assert given_up == pytest.approx(arrives + COLLAGE.battery_resistance * current * current)


def test_a_table_has_five_rows_at_least():
    table = raw()
    table["assumed"]["rows"] = []
    table["measured"]["rows"] = rows = [[J, 0.13 - 0.15 * J * J, 0.06] for J in (0.0, 0.3, 0.6, 0.9, 1.2)]
    assert propeller_of("short", table).thrust_fit == pytest.approx((0.13, 0.0, -0.15), abs=1e-6)
    del rows[2]
    with pytest.raises(PropellerError, match="five finite rows or more"):
        propeller_of("shorter", table)


BENCH = ((4906.0, 0.386), (8611.0, 1.33), (11625.0, 2.468), (12959.0, 3.115), (14293.0, 3.892), (16121.0, 5.056))


@pytest.mark.parametrize(("rpm", "newton"), BENCH)
def test_the_built_aircraft_s_propeller_gives_what_its_bench_read(rpm, newton):
    """Of which thrust by the square of the speed alone would miss the slowest by a quarter."""
    assert thrust(rpm * math.pi / 30.0, 0.0, DARKO) == pytest.approx(newton, rel=0.04)


@pytest.mark.parametrize("damage", [{"rows": [[1.0, 2.0]]}, {"rows": [[1.0], [2.0]]}, {"rows": [[9.0, -1.0]] * 4}])
def test_a_bench_that_is_none_is_refused(damage):
    table = tomllib.loads((files("sitl.model.propellers") / "t5147.toml").read_text())
    table["bench"] |= damage
    with pytest.raises(PropellerError, match="propeller half: "):
        propeller_of("half", table)


def test_the_speed_of_the_hover_carries_the_weight_and_the_drag_in_the_slipstream():
    for a in (COLLAGE, NOMINAL, DARKO):
        carried = 2.0 * thrust(hover_speed(a), 0.0, a) * (1.0 - a.S_ratio * a.C_d0)
        assert carried == pytest.approx(a.m * a.g)


@pytest.mark.parametrize(
    ("hover", "told"), [(500.0, 500.0), (600.0, 600.0), (650.0, 600.0), (700.0, 600.0), (1400.0, 1200.0)]
)
def test_vibration_is_told_for_the_vehicle_s_own_hover(tmp_path, hover, told):
    path, lifted = tmp_path / "mine.toml", 0.5 * NOMINAL.m * NOMINAL.g / (1.0 - NOMINAL.S_ratio * NOMINAL.C_d0)
    entries = {"k_f": ("kg m", lifted / hover**2), "k_m": ("kg m2", 2e-7), "omega_max": ("rad/s", 2.0 * hover)}
    lines = ['[set]\nname = "mine"\ndescription = "x"\nbase = "nominal"']
    lines += [f'[{key}]\nvalue = {value}\nunit = "{unit}"\nsource = "x"' for key, (unit, value) in entries.items()]
    path.write_text("\n".join(lines))
    assert load(str(path)).parameters.vibration_speed == pytest.approx(told)


def test_the_older_sets_vibrate_as_they_did():
    older = set(available()) - {"darko", "flight-code"}
    assert {load(name).parameters.vibration_speed for name in older} == {600.0}
