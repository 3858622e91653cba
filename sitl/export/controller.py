"""The controller that flies as files of C: what a register generates, and one control period around it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, get_type_hints

import numpy as np

from sitl.control import wind_estimator
from sitl.control.estimate import Estimate, Readings
from sitl.control.reference import Reference
from sitl.control.wind_estimator import WindGains, WindState
from sitl.export.c_program import GeneratedText, Instance, Program
from sitl.export.c_types import ArrayKind, ExportError, Kind, Types, identifier
from sitl.export.estimator import INSTEAD, EstimatorExport, NavigationSettings
from sitl.export.flat import flat_file
from sitl.export.initial_values import initialiser
from sitl.export.single_precision import CONSTANTS
from sitl.export.templates import template
from sitl.model.actuators import limited, moved
from sitl.model.airframe import Airframe
from sitl.model.state import Actuators
from sitl.sensors.draws import PERIOD
from sitl.simulation.dispatch import Register
from sitl.simulation.flight import Controller, Design, Flight, may_turn, run_timers
from sitl.simulation.loop import MAX_CHAIN
from sitl.simulation.start import entered
from sitl.storage import path_written

# Arguments in the text of a period: what stands for them, a pointer to them, and their kind.
_PASSED = (
    ("@wind_gains@", "&darko->design->gains.wind", WindGains),
    ("@initial_wind_gains@", "&design->gains.wind", WindGains),
    ("@readings@", "readings", Readings),
    ("@wind@", "&flight->controller.wind", WindState),
    ("@command@", "&flight->controller.command", Actuators),
    ("@now@", "now", Actuators),
    ("@output@", "&darko->output", Actuators),
    ("@airframe@", "&darko->design->a", Airframe),
)


class Parts(NamedTuple):
    """Functions that one control period calls."""

    tick: Instance
    seek: Instance
    jump: Instance
    is_known: Instance
    values: Instance
    run_timers: Instance
    entered: Instance
    limited: Instance
    may_turn: Instance
    moved: Instance
    update_wind: Instance
    start_wind: Instance


class Export(NamedTuple):
    """An export: its files by name, and the kinds that cross its border."""

    files: dict[str, str]
    types: Types
    flight: Kind
    design: Kind


def export(
    register: Register,
    design: Design,
    *,
    single: bool = False,
    title: str = "",
    navigation: NavigationSettings | None = None,
) -> Export:
    """Translate the controller of a register.

    Args:
        register: Laws, guards, resets and jumps.
        design: Gains, thresholds and the model of the airframe.
        single: Whether to use floats instead of doubles.
        title: Said of the design in its header.
        navigation: What the estimator is told of its instruments; without it none is translated.

    Raises:
        ExportError: If something has no C; it says where.
    """
    controller = get_type_hints(register.flight_type)["controller"]
    # Aboard there is no plant, no gust, no battery: of the flight only what the controller sees and keeps.
    named: Any = NamedTuple  # made of types that are known now only
    flight: Any = named("Flight", [("estimate", Estimate), ("controller", controller)])
    instead: dict[type, type] = {register.flight_type: flight, Flight: flight, Controller: controller, **INSTEAD}
    if register.design_type is not Design:
        instead[Design] = register.design_type
    types = Types(design, single, instead)
    compiled = register.compile()
    kinds: dict[str, Kind] = {
        "law": int,
        "row": int,
        "flight": flight,
        "reference": Reference,
        "design": types.resolved(Design),
    }
    generated = {
        function: GeneratedText(text, {name: kinds[name] for name in _parameters(function)} | _returns(function))
        for function, text in register.texts.items()
    }
    program = Program(types, generated, path_written, CONSTANTS if single else {})
    made = compiled._asdict()
    made.update(
        run_timers=run_timers,
        entered=entered,
        limited=limited,
        may_turn=may_turn,
        moved=moved,
        update_wind=wind_estimator.update,
        start_wind=wind_estimator.start,
    )
    parts = Parts(**{name: program.instance(made[name]) for name in Parts._fields})
    estimator = EstimatorExport(program, types, navigation, design.a) if navigation is not None else None
    if unused := sorted(program.unused_constants()):
        raise ExportError(f"{unused[0][0]}.{unused[0][1]} has a value of its own in floats, and is used nowhere")
    files = {f"{module.stem}.h": program.file_of(module) for module in program.modules.values()}
    files["darko_types.h"] = _types_file(types)
    files["darko_gains.h"] = _gains_file(types, design, title)
    files["darko_controller.h"] = template("darko_controller.h")
    files["darko_controller.c"] = program.finished(_controller_file(parts, types))
    files["darko_flat.c"] = flat_file(types, types.name(parts.values.returns))
    if estimator is not None:
        files |= estimator.files(title or "a design")
    return Export(files, types, flight, kinds["design"])


def _parameters(function: Callable[..., Any]) -> tuple[str, ...]:
    return function.__code__.co_varnames[: function.__code__.co_argcount]


def _returns(function: Callable[..., Any]) -> dict[str, Kind]:
    """Kinds of what the generated functions give, where it is not told by what they return."""
    return {"return": bool} if function.__name__ == "is_known" else {}


def _types_file(types: Types) -> str:
    for kind in (Estimate, Reference, Readings, Actuators, Flight, Design):
        types.name(kind)
    structs = "\n".join(types.declarations()).rstrip()
    return template("darko_types.h").replace("@real@", types.real).replace("@structs@", structs)


def _gains_file(types: Types, design: Design, title: str) -> str:
    lines = [f"/* Gains, thresholds and the airframe as the controller knows it: {title or 'a design'}. */"]
    lines += ["#ifndef DARKO_GAINS_H", "#define DARKO_GAINS_H", "", "#include <math.h>", '#include "darko_types.h"', ""]
    name = types.name(Design)
    lines += [f"static const {name} darko_design = {{"]
    lines += initialiser(types, types.resolved(Design), design, "    ")
    return "\n".join([*lines, "};", "", "#endif", ""])


def _controller_file(parts: Parts, types: Types) -> str:
    text = template("darko_controller.c")
    for place, pointer, kind in _PASSED:
        text = text.replace(place, pointer if types.by_pointer(kind) else _pointed_at(pointer))
    for name, part in parts._asdict().items():
        text = text.replace(f"@{name}@", part.token)
    needed = sorted({part.module.stem for part in parts})
    text = text.replace("@includes@", "\n".join(f'#include "{stem}.h"' for stem in needed))
    text = text.replace("@max_chain@", str(MAX_CHAIN)).replace("@period@", types.number(PERIOD))
    finite = [place for place, kind in leaves(types, Estimate, "estimate->") if kind is float]
    sums = " &&\n        ".join(f"is_finite({place})" for place in finite)
    text = text.replace("@values_type@", types.name(parts.values.returns))
    return text.replace("@finite@", sums).replace("@real@", types.real)


def _pointed_at(pointer: str) -> str:
    return pointer[1:] if pointer.startswith("&") else f"*{pointer}"


def leaves(types: Types, kind: Kind, place: str) -> Iterator[tuple[str, Kind]]:
    """Places of all numbers in a struct, in order, and their kinds.

    Args:
        types: Structs.
        kind: The struct, or a part of one.
        place: Where it is, to which fields' names are added.
    """
    for field, part in types.fields(kind).items():
        at = f"{place}{identifier(field)}"
        if types.is_struct(part):
            yield from leaves(types, part, f"{at}.")
        elif isinstance(part, ArrayKind):
            for index in np.ndindex(*part.shape):
                yield at + "".join(f"[{i}]" for i in index), float
        else:
            yield at, part
