"""Tasks of ``darko-sitl export``: writing the files, and comparing what they compute with what flies here."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from traceback import extract_tb

import numpy as np

from protocol.tools.files import write_atomically
from sitl.export.autopilots import module_files
from sitl.export.build import ESTIMATOR_SOURCES, FlatController, shared_library
from sitl.export.builds import FLY, NAVIGATE, flown_by_all, write_flight, write_navigation
from sitl.export.c_types import ExportError
from sitl.export.controller import export
from sitl.export.estimator import NavigationSettings, navigation_of
from sitl.export.flown_again import Difference, RecordedFlight, compared
from sitl.export.navigated_again import FlatEstimator, NavigationDifference, RecordedNavigation, compared_navigation
from sitl.export.random_flights import random_flight
from sitl.export.random_navigation import random_navigation
from sitl.export.single_precision import ESTIMATE_PARTS, command_differences, estimate_differences
from sitl.model.airframe import Airframe
from sitl.model.airframe_files import load
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.avionics import Navigation as Source
from sitl.simulation.dispatch import REGISTER, Register
from sitl.simulation.flight import Design
from sitl.simulation.tuning import CONTROLLERS, Tuning, designed


def write(args: argparse.Namespace) -> int:
    """Write the controller of an airframe into a folder."""
    register = named_register(args.register)
    airframe = load(args.airframe)
    tuning = Tuning()
    design = register.design(designed(airframe.parameters, tuning))
    flies = next(name for name, number in CONTROLLERS.items() if number == tuning.controller)
    precision = "single" if args.float32 else "double"
    words = [f"{flies} controller", f"airframe {args.airframe}", f"{precision} precision"]
    navigation = _navigation(args, design)
    if navigation is not None:
        words.append(f"estimator by {args.estimator}" + (f" of {args.sensors}" if args.sensors else ""))
    title = ", ".join(words)
    made = export(register, design, single=args.float32, title=title, navigation=navigation)
    files = made.files | module_files(args.autopilot)
    for name, text in files.items():
        path = args.folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, text.encode())
        except FileExistsError as error:
            raise ExportError(f"{path.parent} is a file, no folder") from error
        except OSError as error:
            raise ExportError(f"{path} cannot be written: {error.strerror}") from error
    for name in ESTIMATOR_SOURCES:
        if name not in files:  # one of an earlier export would be compiled with this one
            (args.folder / name).unlink(missing_ok=True)
    lines = sum(text.count("\n") for text in files.values())
    print(f"{len(files)} files, {lines} lines, in {args.folder}: {title}")
    return 0


def _navigation(args: argparse.Namespace, design: Design) -> NavigationSettings | None:
    """Settings of the estimator, where one is asked for."""
    if args.estimator is None:
        if args.sensors is not None:
            raise ExportError(f"--sensors {args.sensors}: without --estimator no sensor is read")
        return None
    return navigation_of(load_sensors(args.sensors), design.gains.wind, arena=args.estimator == "mocap")


def named_register(name: str) -> Register:
    """The register that ``MODULE:NAME`` names; the vehicle's own of no name.

    Raises:
        ExportError: If there is none.
    """
    if not name:
        return REGISTER
    module, _, attribute = name.partition(":")
    if not attribute:
        raise ExportError(f"--register {name} is no MODULE:NAME")
    sys.path.insert(0, str(Path.cwd()))
    try:
        found = getattr(import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise ExportError(f"--register {name}: {error}") from error
    except Exception as error:  # it is the user's code that runs
        at = extract_tb(error.__traceback__)[-1]
        words = str(error) if isinstance(error, SyntaxError) else f"{error} ({at.filename}, line {at.lineno})"
        raise ExportError(f"--register {name}: {type(error).__name__}: {words}") from error
    if not isinstance(found, Register):
        raise ExportError(f"--register {name} is a {type(found).__name__}, no Register")
    return found


def check(args: argparse.Namespace) -> int:
    """Fly flights of chance here and by the files of a folder, and say how they differ."""
    register = named_register(args.register)
    library = shared_library(args.folder)
    code = FlatController(library)
    airframe = load(args.airframe).parameters
    # One at a time: a long flight takes megabytes.
    flights = (random_flight(n, args.seconds, (airframe,), args.seed, register) for n in range(args.flights))
    wrong = _check_all(args, flights, code) if args.builds == "all" else _check_controller(flights, code)
    if (args.folder / ESTIMATOR_SOURCES[0]).is_file():
        wrong = max(wrong, _check_estimator(args, airframe, FlatEstimator(library)))
    return wrong


def _check_controller(flights: Iterable[RecordedFlight], code: FlatController) -> int:
    if code.is_single:
        return _tell_single(np.array([command_differences(flight, code) for flight in flights]))
    differences = [compared(flight, code) for flight in flights]
    periods, jumps = sum(one.periods for one in differences), sum(one.jumps for one in differences)
    return _tell(differences, "the same", f"{periods} periods, {jumps} jumps")


def _check_all(args: argparse.Namespace, flights: Iterable[RecordedFlight], code: FlatController) -> int:
    """Fly by all builds; in floats as the first of them does, since doubles never do the same."""
    counts = np.zeros(2, int)

    def expected() -> Iterator[RecordedFlight]:
        for flight in flights:
            counts[:] += len(flight.rows) - 1, flight.jumps
            seen = code.replay(flight.design, flight.begin, flight.rows)[0] if code.is_single else flight.controllers
            yield flight._replace(controllers=seen)

    wrong = flown_by_all(args.folder, FLY, expected(), write_flight)
    print(f"{counts[0]} periods, {counts[1]} jumps")
    return wrong


def _check_estimator(args: argparse.Namespace, airframe: Airframe, code: FlatEstimator) -> int:
    """Navigate flights of chance here and by the estimator of a folder, and say how they differ."""
    source = Source.MOCAP if code.is_in_arena else Source.SENSORS
    flights = (
        random_navigation(number, args.seconds, airframe, load_sensors(), source, args.seed)
        for number in range(args.flights)
    )
    if args.builds == "all":
        return flown_by_all(args.folder, NAVIGATE, (_as_by(code, flight) for flight in flights), write_navigation)
    if code.is_single:
        apart = np.max([estimate_differences(flight, code) for flight in flights], axis=0)
        told = ", ".join(
            f"{name} {most:.2e} {unit}" for (name, unit, _), most in zip(ESTIMATE_PARTS, apart, strict=True)
        )
        print(f"estimates differ by at most: {told}")
        return 0
    found = [compared_navigation(flight, code) for flight in flights]
    periods, readings = sum(one.periods for one in found), sum(one.readings for one in found)
    return _tell(found, "navigated the same", f"{periods} periods, {readings} readings")


def _as_by(code: FlatEstimator, flight: RecordedNavigation) -> RecordedNavigation:
    if not code.is_single:
        return flight
    estimates, end = code.navigate(flight)
    return flight._replace(estimates=estimates, end=end)


def _tell(found: Sequence[Difference] | Sequence[NavigationDifference], done: str, counts: str) -> int:
    """Print which flights differ, and how many do not; 1 if one does."""
    wrong = [one for one in found if not one.is_none]
    for one in wrong:
        print(f"{one.name}: {one.words}")
    print(f"{len(found) - len(wrong)} of {len(found)} flights {done} to the bit: {counts}")
    return 1 if wrong else 0


def _tell_single(rows: np.ndarray) -> int:
    names = ("motors, of the fastest speed", "elevons, of their travel")
    for name, column in zip(names, rows.T, strict=True):
        half, most = np.quantile(column, 0.5), column.max()
        print(f"{name}: a command differs by at most {most:.2e} in any flight, {half:.2e} in half of them")
    return 0
