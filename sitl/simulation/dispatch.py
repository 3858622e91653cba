"""From the register of laws, the guards and the table of jumps to compiled functions: each written once, as data.

The code made here is a chain of comparisons that calls the registered functions with the arguments they name. A law
evaluates only the guards, and those only the Lyapunov values, that its own jumps look at.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, get_type_hints

from sitl.compiled import kernel, subroutine
from sitl.control.estimate import Estimate
from sitl.control.laws import LAWS, VALUES, Gains, LawRow, LawStates, ValueRow
from sitl.errors import SitlError, UnknownLawError
from sitl.sensors.draws import PERIOD
from sitl.simulation.flight import (
    Controller,
    Design,
    Flight,
)
from sitl.simulation.register_checks import check
from sitl.storage import value_of, writer_at
from sitl.supervisor.guards import Guard
from sitl.supervisor.resets import Reset, begin_anew
from sitl.supervisor.table import TABLE, Jump

# What a parameter's name stands for in the generated code; the laws' state slots are added to these.
_CONTROLLER = ("has_crashed", "law_time", "at_rest", "inhibited", "is_armed", "is_flying", "is_landing")
_CONSTANTS = {"dt": "PERIOD"}
_STATE = "state"  # a law's parameter that holds several of its slots
SHOWN = ("v_hover", "v_forward", "v_attitude")  # Lyapunov values that are recorded and reported; 0 without such a law


class Compiled(NamedTuple):
    """The generated functions; flights, references and designs are records."""

    tick: Callable[..., None]  # (law, flight, reference, design): the law in force computes its commands
    seek: Callable[..., int]  # (law, flight, reference, design) -> the same, looking no further than it must
    jump: Callable[..., None]  # (row, flight, reference, design): the jump's reset map and new law
    is_known: Callable[[int], bool]
    values: Callable[..., tuple[float, ...]]  # (flight, reference, design) -> the values of SHOWN
    v_hover: Callable[..., float]  # (flight, reference, design) -> the first of them


class Register:
    """Laws, Lyapunov values and jumps, what they keep, and what is generated from them."""

    def __init__(
        self,
        laws: Iterable[LawRow] = LAWS,
        values: Iterable[ValueRow] = VALUES,
        table: Mapping[Any, tuple[Jump, ...]] = TABLE,
        *,
        states: Mapping[str, type] | None = None,
        gains: Mapping[str, tuple[Any, ...]] | None = None,
    ) -> None:
        """Register laws; by default the vehicle's own.

        Args:
            laws: Every law; its number is a member of an IntEnum, Law or another.
            values: The Lyapunov values that guards look at.
            table: The jumps of every law.
            states: State slots besides those of LawStates, by name: NamedTuples of numbers.
            gains: Gains besides those of Gains, by name: NamedTuples of numbers and arrays.

        Raises:
            SitlError: If they do not fit together; see :func:`sitl.simulation.register_checks.check`.
        """
        rows = list(laws)
        self.values = {row.name: row for row in values}
        self.table = dict(table)
        self.gains = dict(gains or {})
        check(rows, self.table, states or {}, self.gains)
        self.laws: dict[Any, LawRow] = {row.law: row for row in rows}
        states_type = _extended("LawStates", LawStates, states or {})
        self.slots: tuple[str, ...] = states_type._fields
        controller = _extended("Controller", Controller, {"states": states_type})
        self.flight_type: Any = _extended("Flight", Flight, {"controller": controller})
        gains_type = _extended("Gains", Gains, {name: type(value) for name, value in self.gains.items()})
        self.design_type: Any = _extended("Design", Design, {"gains": gains_type})
        self.navigate: Callable[..., Estimate] | None = None  # another navigation filter than the vehicle's own
        self.texts: dict[Callable[..., Any], str] = {}  # of the functions generated so far

    def law(self, number: int) -> Any:  # noqa: ANN401 - a member of Law, or of the IntEnum it was registered by
        """The law of a number.

        Raises:
            UnknownLawError: If none is registered by it.
        """
        row = self.laws.get(number)  # a law is equal to its number
        if row is not None:
            return row.law
        raise UnknownLawError(f"law {number} is not one of {', '.join(law.name for law in self.laws)}")

    def design(self, design: Design) -> Design:
        """A design with the registered gains."""
        if not self.gains:
            return design
        gains_type = get_type_hints(self.design_type)["gains"]
        made: Design = self.design_type(design.a, gains_type(*design.gains, *self.gains.values()), design.thresholds)
        return made

    def compile(self) -> Compiled:
        """Generate the functions; they are compiled where they are first called."""
        for name in self.values:
            self._value(name, {})  # refused where it asks for what is not there, whether a guard looks at it or not
        return Compiled(
            tick=kernel(self._made("tick", self._tick())),
            seek=subroutine(self._made("seek", self._seek())),
            jump=subroutine(self._made("jump", self._jump())),
            is_known=kernel(self._made("is_known", self._is_known())),
            values=subroutine(self._made("values", self._all_values())),
            v_hover=subroutine(self._made("v_hover", self._v_hover())),
        )

    # Code

    def _made(self, name: str, source: tuple[list[str], dict[str, Any]]) -> Callable[..., Any]:
        lines, scope = source
        text = "\n".join(lines) + "\n"
        exec(compile(text, f"<{name} of the laws>", "exec"), scope)  # noqa: S102 - made here
        self.texts[scope[name]] = text
        return scope[name]  # type: ignore[no-any-return]

    def _call(
        self,
        function: Callable[..., Any],
        scope: dict[str, Any],
        what: str,
        gains: str = "",
        made: Mapping[str, str] | None = None,
    ) -> str:
        """The arguments of a registered function, taken by name from where they are kept, but for those made already.

        Raises:
            SitlError: If it names something that is not there.
        """
        made = made or {}
        parameters = list(inspect.signature(function).parameters)
        return ", ".join(made.get(name) or self._source(name, scope, what, gains) for name in parameters)

    def _source(self, name: str, scope: dict[str, Any], what: str, gains: str) -> str:
        if name in _CONSTANTS or name in self.values:
            return _CONSTANTS.get(name, name)
        places = {
            "estimate": "flight.estimate",
            "reference": "reference",
            "a": "design.a",
            "thresholds": "design.thresholds",
            "guidance": "design.gains.line_of_sight.guidance",
            **{field: f"flight.controller.{field}" for field in _CONTROLLER},
            **{slot: f"flight.controller.states.{slot}" for slot in self.slots},
            **{f"{own}_gains": f"design.gains.{own}" for own in (*Gains._fields, *self.gains)},
        }
        if gains:
            places["gains"] = f"design.gains.{gains}"
        if name not in places:
            raise SitlError(f"{what} asks for {name!r}: there is {', '.join(sorted(places))}")
        scope["value_of"] = value_of
        return f"value_of({places[name]})"

    def _stores(self, names: Iterable[str], scope: dict[str, Any], indent: str) -> list[str]:
        lines = []
        for name in names:
            path = ("controller", *(("states",) if name in self.slots else ()), name)
            scope[f"put_{name}"] = writer_at(self.flight_type, path)
            lines.append(f"{indent}put_{name}(flight, {name})")
        return lines

    def _tick(self) -> tuple[list[str], dict[str, Any]]:
        """Each step in a function of its own, so that none pays for the others' numbers; laws share theirs."""
        lines = ["def tick(law, flight, reference, design):"]
        scope: dict[str, Any] = {}
        for (step, gains), laws in self._laws_by_step().items():
            name = f"tick_{int(laws[0])}"
            scope[name] = subroutine(self._made(name, self._law_tick(name, LawRow(laws[0], step, gains))))
            test = " or ".join(f"law == {int(law)}" for law in laws)
            lines += [f"    if {test}:", f"        {name}(flight, reference, design)"]
        return [*lines, "    return"], scope

    def _laws_by_step(self) -> dict[tuple[Callable[..., Any], str], list[Any]]:
        shared: dict[tuple[Callable[..., Any], str], list[Any]] = {}
        for law, row in self.laws.items():
            shared.setdefault((row.step, row.gains), []).append(law)
        return shared

    def _law_tick(self, name: str, row: LawRow) -> tuple[list[str], dict[str, Any]]:
        scope: dict[str, Any] = {"PERIOD": PERIOD, "step": row.step}
        slots, kind = self._kept_by(row)
        if kind is None:
            arguments, given = self._call(row.step, scope, f"law {row.law.name}", row.gains), slots
        else:
            scope["State"] = kind
            state = f"State({self._call(kind, scope, f'the state of law {row.law.name}')})"
            arguments, given = self._call(row.step, scope, f"law {row.law.name}", row.gains, {_STATE: state}), [_STATE]
        lines = [f"def {name}(flight, reference, design):"]
        lines.append(f"    {', '.join(['command', 'saturation', *given])} = step({arguments})")
        if kind is not None:
            lines.append(f"    {', '.join(slots)}, = {_STATE}")
        return lines + self._stores(["command", "saturation", *slots], scope, "    "), scope

    def _kept_by(self, row: LawRow) -> tuple[list[str], Any]:
        """The state slots of a law, and the type that it takes them in, or None where it takes each by itself.

        Raises:
            SitlError: If it wants more than slots together.
        """
        parameters = inspect.signature(row.step).parameters
        if _STATE not in parameters or _STATE in self.slots:
            return [slot for slot in parameters if slot in self.slots], None
        kind = get_type_hints(row.step).get(_STATE)
        slots = list(getattr(kind, "_fields", ()))
        if not slots or not set(slots) <= set(self.slots):
            raise SitlError(f"the state of law {row.law.name} is no NamedTuple of slots: {', '.join(self.slots)}")
        return slots, kind

    def _seek(self) -> tuple[list[str], dict[str, Any]]:
        lines = ["def seek(law, flight, reference, design):"]
        scope: dict[str, Any] = {}
        for law, jumps in self.table.items():
            name = f"seek_{int(law)}"
            scope[name] = subroutine(self._made(name, self._law_seek(name, jumps)))
            lines += [f"    if law == {int(law)}:", f"        return {name}(flight, reference, design)"]
        return [*lines, "    return -1"], scope

    def _law_seek(self, function: str, jumps: tuple[Jump, ...]) -> tuple[list[str], dict[str, Any]]:
        """A Lyapunov value is worked out once, and where one row alone looks at it, only if its other guards hold."""
        lines = [f"def {function}(flight, reference, design):"]
        scope: dict[str, Any] = {}
        known: set[str] = set()
        for row, jump in enumerate(jumps):
            later = {name for other in jumps[row + 1 :] for name in self._values_of(other)}
            fresh = [name for name in self._values_of(jump) if name not in known]
            shared = [name for name in fresh if name in later]
            own = [name for name in fresh if name not in later]
            known.update(shared)
            lines += [f"    {name} = {self._value(name, scope)}" for name in shared]
            first, last = self._terms(jump, own, scope)
            indent = "    "
            if own:
                lines.append(f"{indent}if {' and '.join(first) or True}:")
                indent += "    "
                lines += [f"{indent}{name} = {self._value(name, scope)}" for name in own]
            lines += [f"{indent}if {' and '.join(last if own else first) or True}:", f"{indent}    return {row}"]
        return [*lines, "    return -1"], scope

    def _values_of(self, jump: Jump) -> list[str]:
        """The Lyapunov values that the guards of a row look at."""
        wanted = [name for guard in (*jump.when, *jump.unless) for name in inspect.signature(guard.test).parameters]
        return [name for name in dict.fromkeys(wanted) if name in self.values]

    def _terms(self, jump: Jump, late: list[str], scope: dict[str, Any]) -> tuple[list[str], list[str]]:
        """The comparisons of a row: those that look at none of the values ``late``, and those that do."""
        first: list[str] = []
        last: list[str] = []
        for guard, sign in (*((guard, "") for guard in jump.when), *((guard, "not ") for guard in jump.unless)):
            diagnostics_rows = any(name in late for name in inspect.signature(guard.test).parameters)
            (last if diagnostics_rows else first).append(sign + self._test(guard, scope))
        return first, last

    def _value(self, name: str, scope: dict[str, Any]) -> str:
        row = self.values[name]
        scope[f"value_{name}"] = row.value
        return f"value_{name}({self._call(row.value, scope, f'value {name}', row.gains)})"

    def _test(self, guard: Guard, scope: dict[str, Any]) -> str:
        scope[f"is_{guard.name}"] = guard.test
        return f"is_{guard.name}({self._call(guard.test, scope, f'guard {guard.name}')})"

    def _jump(self) -> tuple[list[str], dict[str, Any]]:
        lines = ["def jump(law, row, flight, reference, design):", "    target = law"]
        scope: dict[str, Any] = {}
        rows = [(law, row, jump) for law, jumps in self.table.items() for row, jump in enumerate(jumps)]
        for law, row, jump in rows:
            lines.append(f"    target = {int(jump.target)} if law == {int(law)} and row == {row} else target")
        lines += self._reset(begin_anew, scope, "    ")
        for reset in dict.fromkeys(reset for _, _, jump in rows for reset in jump.resets):
            users = [f"law == {int(law)} and row == {row}" for law, row, jump in rows if reset in jump.resets]
            lines += [f"    if {' or '.join(users)}:", *self._reset(reset, scope, "        ")]
        return [*lines, "    law = target", *self._stores(["law"], scope, "    ")], scope

    def _reset(self, reset: Reset, scope: dict[str, Any], indent: str) -> list[str]:
        scope[f"reset_{reset.name}"] = reset.map
        arguments = self._call(reset.map, scope, f"reset {reset.name}")
        made = f"{indent}{', '.join(reset.sets)} = reset_{reset.name}({arguments})"
        return [made, *self._stores(reset.sets, scope, indent)]

    def _all_values(self) -> tuple[list[str], dict[str, Any]]:
        scope: dict[str, Any] = {}
        calls = [self._value(name, scope) if name in self.values else "0.0" for name in SHOWN]
        return ["def values(flight, reference, design):", f"    return {', '.join(calls)}"], scope

    def _v_hover(self) -> tuple[list[str], dict[str, Any]]:
        scope: dict[str, Any] = {}
        value = self._value("v_hover", scope) if "v_hover" in self.values else "0.0"
        return ["def v_hover(flight, reference, design):", f"    return {value}"], scope

    def _is_known(self) -> tuple[list[str], dict[str, Any]]:
        test = " or ".join(f"law == {int(law)}" for law in self.laws)
        return ["def is_known(law):", f"    return {test}"], {}


def _extended(name: str, base: Any, parts: Mapping[str, type]) -> Any:  # noqa: ANN401 - NamedTuple types
    """A NamedTuple type with parts added or replaced; the base itself where there are none to add."""
    hints = get_type_hints(base)
    if all(hints.get(part) is kind for part, kind in parts.items()):
        return base
    return NamedTuple(name, list({**hints, **parts}.items()))


REGISTER = Register()
COMPILED = REGISTER.compile()

__all__ = ["COMPILED", "REGISTER", "Compiled", "Register"]
