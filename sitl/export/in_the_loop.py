"""The exported code in the loop of the simulator: laws, guards and jumps are called from the shared library.

The flight's record stays the simulator's own: before each call its controller, its estimate and the reference are made
flat, and after it what the code kept is put back. Gains and thresholds are those of the export, whatever the
simulation's tuning says; everything else, autopilot and telemetry included, sees no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from sitl.compiled import subroutine
from sitl.control.estimate import Ages, Estimate
from sitl.control.reference import Reference
from sitl.estimation.filter import Filter
from sitl.export.build import ESTIMATOR_SOURCES, FlatController, shared_library
from sitl.export.c_types import ExportError
from sitl.export.flat import flattened
from sitl.export.navigated_again import FlatEstimator
from sitl.model.quaternions import Quaternion
from sitl.model.state import Actuators
from sitl.model.vectors import Vector
from sitl.sensors.instruments import Instruments
from sitl.simulation.dispatch import SHOWN, Compiled, Register
from sitl.simulation.flight import Design
from sitl.storage import Records, fields, is_compound, writer_at


class ExportedRegister(Register):
    """The laws of a register, flown by the files that were exported of it.

    Args:
        folder: Where ``darko-sitl export c`` wrote.
        register: What it was exported of; the vehicle's own laws by default.

    Raises:
        ExportError: If the files cannot be compiled, or are of other laws.
    """

    def __init__(self, folder: Path, register: Register | None = None) -> None:
        """Compile and load the files."""
        own = register or Register()
        super().__init__(own.laws.values(), own.values.values(), own.table, states=_added(own), gains=own.gains)
        library, self._folder = shared_library(folder), folder
        self._code = FlatController(library)
        self._controller = get_type_hints(self.flight_type)["controller"]
        sizes = [len(list(_leaves(kind))) for kind in (self._controller, Estimate, Reference)]
        if sizes != self._code.sizes()[:3]:
            raise ExportError(f"{folder} was exported of other laws: its controller keeps other numbers than this one")
        if (folder / ESTIMATOR_SOURCES[0]).is_file():
            self.navigate = _navigation(FlatEstimator(library))

    def design(self, design: Design) -> Design:
        """A design with the registered gains; the laws fly that of the export.

        Raises:
            ExportError: If the export is for another airframe: its gains would fly this one badly.
        """
        made = super().design(design)
        ours, theirs = flattened(made), self._code.design()
        if len(ours) != len(theirs):
            raise ExportError(f"{self._folder} was exported by another version of darko: its gains are others")
        width = np.float32 if self._code.is_single else np.float64
        for name, mine, other in zip(design.a._fields, ours.astype(width), theirs.astype(width), strict=False):
            if mine != other:
                words = f"{name} is {other:g} there, {mine:g} here"
                raise ExportError(f"{self._folder} was exported for another airframe: {words}")
        return made

    def compile(self) -> Compiled:
        """Functions that call the library, in place of those that are generated."""
        here = super().compile()
        return here._replace(
            tick=self._called("tick", "law", "", puts=True),
            seek=self._called("seek", "law", "return ", puts=False),
            jump=self._called("jump", "law, row", "", puts=True),
            values=self._called("values", "", "", puts=False),
            v_hover=self._called("values", "", "", puts=False, name="v_hover"),
        )

    def _called(self, what: str, given: str, word: str, *, puts: bool, name: str = "") -> Callable[..., Any]:
        """A function that calls ``flat_...`` of the library with flat values, and puts the controller back."""
        kept = ("c_numbers", "flight.controller", self._controller)
        seen = (("e_numbers", "flight.estimate", Estimate), ("r_numbers", "reference", Reference))
        scope: dict[str, Any] = {"np": np, "called": getattr(self._code.functions, f"flat_{what}")}
        head = ", ".join(part for part in (given, "flight, reference, design") if part)
        lines = [f"def {name or what}({head}):"]
        for numbers, place, kind in (kept, *seen):
            paths = list(_leaves(kind))
            lines.append(f"    {numbers} = np.empty({len(paths)})")
            lines += [f"    {numbers}[{i}] = {'.'.join((place, *path))}" for i, (path, _) in enumerate(paths)]
        arguments = [part for part in (given, "c_numbers.ctypes", "e_numbers.ctypes", "r_numbers.ctypes") if part]
        if what == "values":
            lines += [f"    shown = np.empty({len(SHOWN)})"]
            arguments.append("shown.ctypes")
        lines.append(f"    {word}called({', '.join(arguments)})")
        if what == "values":
            each = [f"shown[{i}]" for i in range(len(SHOWN))]
            lines.append(f"    return {each[0] if name else ', '.join(each)}")
        if puts:
            for i, (path, kind) in enumerate(_leaves(self._controller)):
                scope[f"put_{i}"] = writer_at(self.flight_type, ("controller", *path))
                value = {bool: f"c_numbers[{i}] > 0.0", int: f"int(c_numbers[{i}])"}.get(kind, f"c_numbers[{i}]")
                lines.append(f"    put_{i}(flight, {value})")
        exec(compile("\n".join(lines) + "\n", f"<{what} of the exported code>", "exec"), scope)  # noqa: S102 - made here
        return subroutine(scope[name or what])


def _navigation(code: FlatEstimator) -> Callable[..., Estimate]:
    """A function that calls the library's filter on the simulator's records."""
    size, called = code.estimate_size, code.functions.flat_estimator_navigate

    def navigate(f: Filter, i: Instruments, steps: Records, period: int, wanted: Actuators, has_tube: bool) -> Estimate:
        command, to = np.empty(4), np.empty(size)
        command[0], command[1] = wanted.left_motor, wanted.right_motor
        command[2], command[3] = wanted.left_elevon, wanted.right_elevon
        called(f.covariance.ctypes, i.readings.ctypes, steps.ctypes, period, command.ctypes, int(has_tube), to.ctypes)
        return Estimate(
            position=Vector(to[0], to[1], to[2]),
            velocity=Vector(to[3], to[4], to[5]),
            acceleration=Vector(to[6], to[7], to[8]),
            attitude=Quaternion(to[9], to[10], to[11], to[12]),
            rates=Vector(to[13], to[14], to[15]),
            wind=Vector(to[16], to[17], to[18]),
            actuators=Actuators(to[19], to[20], to[21], to[22]),
            on_ground=to[23] > 0.0,
            age=Ages(to[24], to[25], to[26], to[27], to[28], to[29], to[30], to[31]),
        )

    return subroutine(navigate)


def _added(register: Register) -> dict[str, type]:
    """State slots besides the vehicle's own."""
    states = get_type_hints(get_type_hints(register.flight_type)["controller"])["states"]
    own = set(Register().slots)
    return {slot: kind for slot, kind in get_type_hints(states).items() if slot not in own}


def _leaves(kind: Any) -> Iterator[tuple[tuple[str, ...], type]]:  # noqa: ANN401 - a NamedTuple's class
    """Paths and kinds of all numbers, depth first."""
    for name, part in fields(kind).items():
        if is_compound(part):
            yield from (((name, *path), leaf) for path, leaf in _leaves(part))
        else:
            yield (name,), part
