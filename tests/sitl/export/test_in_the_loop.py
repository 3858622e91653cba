"""The exported code in the simulator's loop: a whole flight, the same bits; and a law of a user's own."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law, Reason
from sitl.compiled import kernel
from sitl.control.estimate import Estimate
from sitl.control.laws import LAWS, LawRow
from sitl.control.reference import along, hover_at, leg
from sitl.errors import SitlError
from sitl.export.build import FlatController, shared_library
from sitl.export.controller import export
from sitl.export.flat import flattened
from sitl.export.in_the_loop import ExportedRegister
from sitl.model.airframe import Airframe
from sitl.model.airframe_files import load
from sitl.model.state import Actuators
from sitl.simulation.avionics import Navigation
from sitl.simulation.dispatch import Register
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.supervisor import guards
from sitl.supervisor.resets import landed
from sitl.supervisor.table import TABLE, Jump
from tests.support.exported import AIRFRAME, DESIGN, estimator_files, estimator_folder, files, folder, need, write
from tests.support.flights.sensed_flights import state_of_all


class OwnLaw(IntEnum):
    CLIMB = 100


class ClimbGains(NamedTuple):
    """A rate."""

    rate: float  # [1/s]


class ClimbState(NamedTuple):
    """Kept by it."""

    height: float  # climbed so far [m]


@kernel
def climb(
    estimate: Estimate, gains: ClimbGains, a: Airframe, climbed: ClimbState, dt: float
) -> tuple[Actuators, int, ClimbState]:
    """Full ahead, the elevons against the pitch rate."""
    pitch = gains.rate * estimate.rates.y
    return Actuators(a.omega_max, a.omega_max, pitch, pitch), 0, ClimbState(climbed.height + dt * estimate.velocity.z)


def own_register():
    disarm = Jump("disarm", Law.LANDED, Reason.DISARM, unless=(guards.armed,), resets=(landed,))
    return Register(
        laws=(*LAWS, LawRow(OwnLaw.CLIMB, climb, "climb")),
        table={**TABLE, OwnLaw.CLIMB: (disarm,)},
        states={"climbed": ClimbState},
        gains={"climb": ClimbGains(0.05)},
    )


def flown(**choice):
    made = Simulation(AIRFRAME, seed=3, start=Start(up=60.0, airborne=True), **choice)
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    made.set_wind((1.0, -0.5, 0.0), 0.3)
    made.reference = along(hover_at((0.0, 0.0, 60.0), 0.4), leg((0.0, 0.0, 60.0), (60.0, 10.0, 62.0), 13.0), 0.4)
    made.step(4.0)
    return made


@pytest.mark.long
def test_a_flight_by_the_exported_code_is_the_same_flight():
    need("cc")
    by_code, ours = flown(register=ExportedRegister(folder())), flown()
    assert (flattened(by_code.flight) == flattened(ours.flight)).all()
    assert [(jump.time, jump.target) for jump in by_code.jumps] == [(jump.time, jump.target) for jump in ours.jumps]
    assert ours.jumps


@pytest.mark.long
def test_a_flight_by_the_exported_estimator_is_the_same_flight():
    need("cc")
    ours = flown(navigation=Navigation.SENSORS)
    by_code = flown(navigation=Navigation.SENSORS, register=ExportedRegister(estimator_folder()))
    assert state_of_all(by_code) == state_of_all(ours)
    assert ours.jumps


@pytest.mark.long
def test_in_floats_a_flight_on_sensors_ends_alike():
    need("cc")
    ours = flown(navigation=Navigation.SENSORS)
    by_code = flown(navigation=Navigation.SENSORS, register=ExportedRegister(estimator_folder(single=True)))
    assert [jump.target for jump in by_code.jumps] == [jump.target for jump in ours.jumps]
    apart = [abs(a - b) for a, b in zip(by_code.truth.body.position, ours.truth.body.position, strict=True)]
    assert 0.0 < max(apart) < 0.1


@pytest.mark.long
def test_a_law_of_a_users_own_is_exported_with_its_state_and_jumps(tmp_path):
    need("cc")
    register = own_register()
    made = export(register, register.design(DESIGN))
    assert "DarkoClimbState climbed;" in made.files["darko_types.h"]
    assert "climb(" in made.files["test_in_the_loop.h"]
    write(tmp_path, made.files)
    code = FlatController(shared_library(tmp_path, options=("-O0",)))
    simulation = Simulation(AIRFRAME, start=Start(up=50.0, airborne=True))
    estimate = simulation.estimate._replace(rates=simulation.estimate.rates._replace(y=0.3))
    controllers, reference = (np.zeros(code.sizes()[i]) for i in (0, 2))
    code.functions.flat_tick(
        int(OwnLaw.CLIMB),
        controllers.ctypes.data,
        flattened(estimate).ctypes.data,
        reference.ctypes.data,
    )
    command, _, _ = climb(estimate, ClimbGains(0.05), AIRFRAME, ClimbState(0.0), 0.002)
    assert (controllers[8:12] == flattened(command)).all()
    with pytest.raises(SitlError, match="was exported of other laws"):
        ExportedRegister(tmp_path)


def test_a_folder_without_an_export_is_refused(tmp_path):
    with pytest.raises(SitlError, match="holds no exported controller: darko-sitl export c"):
        ExportedRegister(tmp_path)


@pytest.mark.long
def test_an_export_for_another_airframe_or_of_another_version_is_refused(tmp_path):
    need("cc")
    with pytest.raises(SitlError, match=r"was exported for another airframe: m is 0\.519 there, 0\.492 here"):
        Simulation(load("nominal").parameters, register=ExportedRegister(folder()))
    old, older = tmp_path / "old", tmp_path / "older"
    text = files().files["darko_flat.c"]
    write(old, files().files | {"darko_flat.c": text.replace("to[3] = DESIGN;", "")})
    with pytest.raises(SitlError, match="by another version of darko: it does not tell its gains"):
        Simulation(AIRFRAME, register=ExportedRegister(old))
    write(older, files().files | {"darko_flat.c": text.replace("flat_begin", "flat_start")})
    with pytest.raises(SitlError, match="by another version of darko: it has no flat_begin"):
        ExportedRegister(older)


@pytest.mark.long
def test_an_estimator_of_another_version_is_refused(tmp_path):
    need("cc")
    write(tmp_path, estimator_files())
    flat = tmp_path / "darko_estimator_flat.c"
    flat.write_text(flat.read_text(encoding="utf-8").replace("to[9] = ", "to[9] = 8 + "), encoding="utf-8")
    with pytest.raises(SitlError, match="by another version of darko: its filter keeps other numbers"):
        ExportedRegister(tmp_path)


@pytest.mark.long
def test_damaged_files_are_refused_in_one_line(tmp_path):
    need("cc")
    write(tmp_path, files().files)
    (tmp_path / "darko_types.h").write_text("struct {\n", encoding="utf-8")
    with pytest.raises(SitlError, match=r"^cc refuses: .*error.*$"):
        ExportedRegister(tmp_path)
