"""What of a plan is flown, and what is refused: each refusal with its construct and place.

A refusal within a block locks that block: it is never entered on request, and where the plan leads into it the vehicle
holds. A refusal outside of blocks refuses the plan.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from protocol.flight_plans.expressions.expression_tree import (
    ArrayItem,
    BlockTitle,
    Call,
    Expression,
    LoopVariable,
    Member,
    Reference,
    Script,
    Tree,
    VariableName,
    walk,
)
from protocol.flight_plans.flight_plan import AbiBinding, FlightPlan, KmlSector, PlanSector, PlanVariable
from protocol.flight_plans.known_names import CONSTANTS, SETTABLE, STRUCTURES, VARIABLES, shape_of
from protocol.flight_plans.name_mapping import NameMapping
from protocol.flight_plans.place import FlightPlanError, Place
from protocol.flight_plans.plan_names import NO_WAYPOINT, block_number, waypoint_constant
from protocol.flight_plans.stages import (
    ForStage,
    GoStage,
    GuidedStage,
    PathStage,
    PlanElement,
    SetStage,
    Stage,
)

__all__ = ["Finding", "PlanCheck", "check_flown"]

NAV_TYPES = {None, "", "nav", "Nav", "NAV"}  # the patterns that every build has
_NEEDED = {"climb", "throttle"}  # vertical modes that need the attribute of their name


@dataclass(frozen=True, slots=True)
class Finding:
    """One construct that is not flown as it stands."""

    place: Place
    construct: str
    reason: str
    block: str | None = None  # None: outside of blocks
    is_refusal: bool = True

    def __str__(self) -> str:
        return f"{self.place}: {self.construct}: {self.reason}"


@dataclass(frozen=True, slots=True)
class PlanCheck:
    """What was found about a plan."""

    plan: FlightPlan
    findings: tuple[Finding, ...]

    @property
    def refusals(self) -> tuple[Finding, ...]:
        """What is not flown."""
        return tuple(finding for finding in self.findings if finding.is_refusal)

    @property
    def notices(self) -> tuple[Finding, ...]:
        """What is left out without harm."""
        return tuple(finding for finding in self.findings if not finding.is_refusal)

    @property
    def locked_blocks(self) -> dict[str, Finding]:
        """Blocks that are not flown, each with its first refusal."""
        locked: dict[str, Finding] = {}
        for finding in self.refusals:
            if finding.block is not None:
                locked.setdefault(finding.block, finding)
        return locked

    def require_flown(self) -> None:
        """Refuse a plan that cannot be flown at all.

        Raises:
            FlightPlanError: Something outside of blocks is refused, or every block is.
        """
        for finding in self.refusals:
            if finding.block is None or len(self.locked_blocks) == len(self.plan.blocks):
                raise FlightPlanError(finding.place, f"{finding.construct}: {finding.reason}")


def check_flown(plan: FlightPlan, mapping: NameMapping | None = None) -> PlanCheck:
    """Look for everything that is not flown.

    Args:
        plan: The plan.
        mapping: What names of a build mean.
    """
    return PlanCheck(plan, tuple(_Checker(plan, mapping or NameMapping()).findings()))


class _Checker:
    """Knows the names of a plan."""

    def __init__(self, plan: FlightPlan, mapping: NameMapping) -> None:
        self._plan, self._mapping = plan, mapping
        self._sectors = frozenset(sector.name for sector in plan.sectors if isinstance(sector, PlanSector))
        self._own = {variable.var for variable in plan.variables if isinstance(variable, PlanVariable)}
        for binding in plan.variables:
            if isinstance(binding, AbiBinding) and binding.vars:
                self._own |= {name.strip() for name in binding.vars.split(",")}
        waypoints = {waypoint_constant(point.name) for point in plan.waypoints}
        self._waypoints = waypoints | {NO_WAYPOINT}

    def findings(self) -> Iterator[Finding]:
        """Everything, in the order of the file."""
        yield from self._left_out()
        for variable in self._plan.variables:
            if isinstance(variable, PlanVariable) and variable.init is not None:
                yield from self._tree(variable.init.tree, (), None)
        for exception in self._plan.exceptions:
            yield from self._tree(exception.cond.tree, (), None)
        for block in self._plan.blocks:
            yield from self._element(block, (), block.name)

    def _left_out(self) -> Iterator[Finding]:
        for variable in self._plan.variables:
            if isinstance(variable, AbiBinding):
                yield Finding(variable.place, f"abi_binding {variable.name}", "no message sets it", is_refusal=False)
        for module in self._plan.modules:
            yield Finding(module.place, f"module {module.name}", "Paparazzi module, ignored", is_refusal=False)
        for sector in self._plan.sectors:
            if isinstance(sector, KmlSector):
                yield Finding(sector.place, f"kml {sector.file}", "the file is not there", is_refusal=False)

    def _element(self, element: PlanElement, loops: Sequence[str], block: str) -> Iterator[Finding]:
        """A block, stage or exception, and all in it."""
        if isinstance(element, Stage):
            yield from self._stage(element, block)
        if isinstance(element, SetStage):
            yield from self._target(element.var.name, element.var.place, block)
        inner = (*loops, element.var) if isinstance(element, ForStage) else loops
        for field in dataclasses.fields(element):
            for part in _parts(getattr(element, field.name)):
                match part:
                    case Expression():
                        if not (field.name == "pitch" and part.tree == VariableName("auto")):
                            yield from self._tree(part.tree, loops, block)
                    case Script():
                        yield from self._script(part, loops, block)
                    case PlanElement():
                        yield from self._element(part, inner, block)
                    case _:
                        pass

    def _stage(self, stage: Stage, block: str) -> Iterator[Finding]:
        if isinstance(stage, GuidedStage) and len(stage.commands) != 4:
            yield Finding(stage.place, "<guided> commands", f"{len(stage.commands)} values, not 4", block)
        nav_type = getattr(stage, "nav_type", None)
        if nav_type not in NAV_TYPES:
            yield Finding(
                stage.place, f"nav_type {nav_type!r}", "navigation pattern of a Paparazzi build, not supported", block
            )
        mode = getattr(stage, "vmode", None)
        if mode in _NEEDED and getattr(stage, mode) is None:
            yield Finding(stage.place, f"vmode {mode!r}", f"needs the attribute {mode!r}", block)
        routed = isinstance(stage, PathStage) or (isinstance(stage, GoStage) and (stage.hmode == "route"))
        if mode == "glide" and not routed:
            yield Finding(stage.place, "vmode 'glide'", "needs hmode 'route'", block)

    def _target(self, name: str, place: Place, block: str) -> Iterator[Finding]:
        meaning = self._mapping.variables.get(name, name)
        if meaning not in self._own | SETTABLE and not isinstance(self._mapping.variables.get(name), int | float):
            yield Finding(
                place, f"set {name}", "no variable of the plan or of this autopilot that a plan may set", block
            )

    def _script(self, script: Script, loops: Sequence[str], block: str) -> Iterator[Finding]:
        for instruction in script.instructions:
            if instruction.target:
                yield from self._target(instruction.target, instruction.place, block)
            if instruction.condition is not None:
                yield from self._tree(instruction.condition, loops, block)
            yield from self._tree(instruction.expression, loops, block)

    def _tree(self, tree: Tree, loops: Sequence[str], block: str | None) -> Iterator[Finding]:
        titles = {
            id(part.arguments[0])
            for part in walk(tree)
            if isinstance(part, Call) and part.name == "IndexOfBlock" and part.arguments
        }
        members = {id(part.call) for part in walk(tree) if isinstance(part, Member)}
        for part in walk(tree):
            reason = self._part(part, loops, is_title=id(part) in titles, is_member=id(part) in members)
            if reason is not None:
                yield Finding(part.place, *reason, block)

    def _part(self, part: Tree, loops: Sequence[str], *, is_title: bool, is_member: bool) -> tuple[str, str] | None:
        """Construct and reason of a refusal of one part, or None."""
        match part:
            case VariableName():
                return None if self._is_variable(part.name) else (part.name, "no such variable or constant")
            case LoopVariable():
                return None if part.name in loops else (f"${part.name}", "no enclosing loop has this counter")
            case Call():
                return self._call(part, is_member=is_member)
            case Member():
                fields = STRUCTURES.get(part.call.name, ())
                return None if part.name in fields else (f"{part.call.name}()->{part.name}", "no such field")
            case BlockTitle():
                return self._title(part, is_title=is_title)
            case ArrayItem():
                return f"{part.name}[]", "no such array"
            case Reference():
                return None if self._is_variable(part.name) else (f"&{part.name}", "no such variable")
            case _:
                return None

    def _title(self, part: BlockTitle, *, is_title: bool) -> tuple[str, str] | None:
        if not is_title:
            return f"'{part.text}'", "a text where a number was expected"
        is_block = block_number(self._plan, part.text) is not None
        return None if is_block else (f"'{part.text}'", "no such block")

    def _is_variable(self, name: str) -> bool:
        known = name in self._own or name in VARIABLES or name in CONSTANTS or name in self._mapping.variables
        return known or name in self._waypoints

    def _call(self, call: Call, *, is_member: bool) -> tuple[str, str] | None:
        meaning = self._mapping.functions.get(call.name, call.name)
        if not isinstance(meaning, str):
            return None
        shape = shape_of(meaning, self._sectors)
        construct = f"{call.name}()"
        if shape is None:
            return construct, "no such function of this autopilot"
        if not shape.least <= len(call.arguments) <= shape.most:
            return construct, f"takes {shape.least} arguments, not {len(call.arguments)}"
        if meaning in STRUCTURES and not is_member:
            return construct, f"gives fields: name one of {', '.join(STRUCTURES[meaning])}"
        for index in shape.changes:
            if not isinstance(call.arguments[index], Reference):
                return construct, f"argument {index + 1} has to be a reference such as &nav.heading"
        return None


def _parts(value: object) -> tuple[object, ...]:
    return value if isinstance(value, tuple) else (value,)
