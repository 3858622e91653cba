"""Check of a plan for constructs that are not flown: each refusal names its construct and place.

A refusal within a block locks that block: it is never entered on request, and where the plan leads into it the vehicle
holds. A refusal outside of blocks refuses the plan. What a build does beside flying (payloads, modules that it starts,
its own variables) is left out, with a notice, and so are exceptions that ask for what only a build knows.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto

from protocol.flight_plans.expressions import (
    ArrayItem,
    BlockTitle,
    Call,
    Expression,
    LoopVariable,
    Member,
    Reference,
    Script,
    Target,
    Tree,
    VariableName,
    expression_text,
    walk,
)
from protocol.flight_plans.flight_plan import (
    AbiBinding,
    AttitudeStage,
    CallStage,
    DerouteStage,
    FlightPlan,
    ForStage,
    GoStage,
    GuidedStage,
    KmlSector,
    ManualStage,
    PathStage,
    PlanElement,
    PlanException,
    PlanSector,
    PlanVariable,
    SetStage,
    Stage,
)
from protocol.flight_plans.plan_limits import is_block, is_waypoint, waypoint_uses
from protocol.flight_plans.plan_names import (
    CONSTANTS,
    COORDINATES,
    NO_WAYPOINT,
    SETTABLE,
    STRUCTURES,
    VARIABLES,
    WAYPOINT_FIELDS,
    WAYPOINTS,
    NameMapping,
    block_number,
    shape_of,
    waypoint_constant,
)
from protocol.flight_plans.xml_elements import FlightPlanError, Place
from protocol.ranges import MIN_CORNERS


@dataclass(frozen=True, slots=True)
class Finding:
    """One construct that is not flown as it stands."""

    place: Place
    construct: str
    reason: str
    block: str | None = None  # None: outside of blocks
    is_refusal: bool = True
    leaves_out: Place | None = None  # of the statement, stage or exception that is passed over

    def __str__(self) -> str:
        return f"{self.place}: {self.construct}: {self.reason}"


@dataclass(frozen=True, slots=True)
class PlanCheck:
    """Findings about a plan."""

    plan: FlightPlan
    findings: tuple[Finding, ...]
    adopted: frozenset[str] = frozenset()  # variables of a build that are kept as the plan's own

    @property
    def left_out(self) -> frozenset[Place]:
        """The statements, stages and exceptions that are passed over."""
        return frozenset(finding.leaves_out for finding in self.findings if finding.leaves_out is not None)

    @property
    def refusals(self) -> tuple[Finding, ...]:
        """Findings that refuse a part of the plan: it is not flown."""
        return tuple(finding for finding in self.findings if finding.is_refusal)

    @property
    def notices(self) -> tuple[Finding, ...]:
        """Findings about parts that are left out without harm."""
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


NAV_TYPES = {None, "", "nav", "Nav", "NAV"}  # the patterns that every build has
_FLIES = re.compile(
    r"_*(nav(?!_throttle_curve)|guidance|stabilization|autopilot|waypoint|wp_|v_ctl|h_ctl|snav|gvf|formation|mission|ctrl|ap_|fly|land|takeoff)",
    re.IGNORECASE,
)  # how names begin of what moves the vehicle
_NEEDED = {"climb", "throttle"}  # vertical modes that need the attribute of their name


def check_flown(plan: FlightPlan, mapping: NameMapping | None = None) -> PlanCheck:
    """Look for everything that is not flown.

    Args:
        plan: The plan.
        mapping: What names of a build mean.
    """
    checker = _Checker(plan, mapping or NameMapping())
    return PlanCheck(plan, tuple(checker.findings()), checker.adopted)


class _Stored(Enum):
    """Treatment of a value that a plan stores."""

    KNOWN = auto()
    FIXED = auto()  # a plan cannot set it
    ADOPTED = auto()
    UNKNOWN = auto()


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
        self.adopted = frozenset[str]()
        self.adopted = self._adoptable()

    def findings(self) -> Iterator[Finding]:
        """Everything, in the order of the file."""
        yield from self._left_out()
        for variable in self._plan.variables:
            if isinstance(variable, PlanVariable) and variable.init is not None:
                yield from self._tree(variable.init.tree, (), None)
        for exception in self._plan.exceptions:
            yield from self._exception(exception, (), None)
        for block in self._plan.blocks:
            yield from self._element(block, (), block.name)

    def _adoptable(self) -> frozenset[str]:
        """Variables that only the plan sets, to values that are known: they can be kept as its own."""
        stored: dict[str, list[Tree]] = {}
        for target, value in _stores(self._plan):
            if isinstance(target, VariableName) and not self._is_variable(target.name):
                stored.setdefault(target.name, []).append(value)
        while True:
            self.adopted = frozenset(stored)
            unknown = [name for name, values in stored.items() if any(map(self._is_unknown, values))]
            if not unknown:
                return self.adopted
            for name in unknown:
                del stored[name]

    def _is_unknown(self, tree: Tree) -> bool:
        loops = [part.name for part in walk(tree) if isinstance(part, LoopVariable)]
        return any(True for _ in self._tree(tree, loops, None))

    def _left_out(self) -> Iterator[Finding]:
        for repeated in self._plan.repeated_attributes:
            yield Finding(repeated.place, repeated.name, "given before in the same tag: the first counts", None, False)
        for variable in self._plan.variables:
            if isinstance(variable, AbiBinding):
                yield Finding(variable.place, f"abi_binding {variable.name}", "no message sets it", is_refusal=False)
        for module in self._plan.modules:
            yield Finding(module.place, f"module {module.name}", "Paparazzi module, ignored", is_refusal=False)
        for sector in self._plan.sectors:
            if isinstance(sector, KmlSector):
                yield Finding(sector.place, f"kml {sector.file}", "the file is not there", is_refusal=False)
            elif len(sector.corners) < MIN_CORNERS:
                reason = f"{len(sector.corners)} corners are no area: nothing is inside"
                yield Finding(sector.place, f"sector {sector.name}", reason, is_refusal=False)

    def _element(self, element: PlanElement, loops: Sequence[str], block: str) -> Iterator[Finding]:
        """A block, stage or exception, and all in it."""
        yield from self._unknown_attributes(element, block)
        if isinstance(element, PlanException):
            yield from self._exception(element, loops, block)
            return
        if isinstance(element, SetStage):
            yield from self._store(element.var.tree, element.value.tree, loops, block, element.place)
            return
        if isinstance(element, Stage):
            yield from self._stage(element, block)
        yield from self._inner(element, loops, block)

    def _inner(self, element: PlanElement, loops: Sequence[str], block: str) -> Iterator[Finding]:
        """All in a block or stage."""
        is_repeated = isinstance(element, CallStage) and element.loop
        inner = (*loops, element.var) if isinstance(element, ForStage) else loops
        for field in dataclasses.fields(element):
            for part in _parts(getattr(element, field.name)):
                match part:
                    case Expression():
                        if not _has_no_effect(element, field.name, part):
                            yield from self._tree(part.tree, loops, block)
                    case Script():
                        yield from self._script(part, loops, block, is_repeated=is_repeated)
                    case PlanElement():
                        yield from self._element(part, inner, block)
                    case _:
                        pass

    def _unknown_attributes(self, element: PlanElement, block: str) -> Iterator[Finding]:
        """Attributes that Paparazzi does not read either."""
        for attribute in element.unknown:
            yield Finding(attribute.place, f"attribute {attribute.name!r}", "no such attribute: ignored", block, False)

    def _exception(self, exception: PlanException, loops: Sequence[str], block: str | None) -> Iterator[Finding]:
        """An exception asks for what is known, or is left out: what a build alone knows never happens here."""
        if not is_block(self._plan, exception.deroute):
            yield Finding(exception.deroute.place, f"deroute {exception.deroute.name!r}", "no such block", block)
        found = next(self._tree(exception.cond.tree, loops, block), None)
        if found is not None:
            reason = f"{found.reason}; the exception to {exception.deroute} is left out"
            yield Finding(found.place, found.construct, reason, block, is_refusal=False, leaves_out=exception.place)

    def _stage(self, stage: Stage, block: str) -> Iterator[Finding]:
        for use in waypoint_uses(stage):
            if not is_waypoint(self._plan, use):
                yield Finding(use.place, f"waypoint {use.name!r}", "no such waypoint", block)
        if isinstance(stage, DerouteStage) and not is_block(self._plan, stage.block):
            yield Finding(stage.block.place, f"deroute {stage.block.name!r}", "no such block", block)
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

    def _store(self, target: Target, value: Tree, loops: Sequence[str], block: str, place: Place) -> Iterator[Finding]:
        """A value is stored in what is known, or in a variable that is kept as the plan's own, or left out."""
        construct = f"set {expression_text(target)}"
        match self._kind_of(target):
            case _Stored.KNOWN:
                parts = target.arguments if isinstance(target, Call) else ()
                index = (target.index,) if isinstance(target, ArrayItem) else ()
                for tree in (*parts, *index, value):
                    yield from self._tree(tree, loops, block)
            case _Stored.FIXED:
                yield Finding(target.place, construct, "a plan cannot set this", block)
            case _Stored.ADOPTED:
                reason = "a variable of a build: kept as the plan's own"
                yield Finding(target.place, construct, reason, block, is_refusal=False)
            case _:
                reason = "known to a build only: left out"
                yield Finding(target.place, construct, reason, block, is_refusal=False, leaves_out=place)

    def _kind_of(self, target: Target) -> _Stored:
        match target:
            case VariableName():
                meaning = self._mapping.variables.get(target.name, target.name)
                if not isinstance(meaning, str) or meaning in self._own | SETTABLE:
                    return _Stored.KNOWN
                if target.name in self.adopted:
                    return _Stored.ADOPTED
                return _Stored.FIXED if self._is_variable(meaning) else _Stored.UNKNOWN
            case Call():
                is_coordinate = target.name in COORDINATES and len(target.arguments) == 1
                return _Stored.KNOWN if is_coordinate else _Stored.UNKNOWN
            case ArrayItem():
                is_coordinate = target.name == WAYPOINTS and target.member in WAYPOINT_FIELDS
                return _Stored.KNOWN if is_coordinate else _Stored.UNKNOWN

    def _script(
        self, script: Script, loops: Sequence[str], block: str, *, is_repeated: bool = False
    ) -> Iterator[Finding]:
        for instruction in script.instructions:
            if instruction.condition is not None:
                yield from self._tree(instruction.condition, loops, block)
            if instruction.target is not None:
                yield from self._store(instruction.target, instruction.expression, loops, block, instruction.place)
                continue
            if self._is_payload(instruction.expression, is_repeated=is_repeated):
                construct = expression_text(instruction.expression)
                reason = "payload of a build: left out"
                yield Finding(
                    instruction.place, construct, reason, block, is_refusal=False, leaves_out=instruction.place
                )
                continue
            yield from self._tree(instruction.expression, loops, block)

    def _is_payload(self, tree: Tree, *, is_repeated: bool) -> bool:
        """Whether a statement calls what a build has beside its flying: unknown, and not named as what flies is."""
        if not isinstance(tree, Call) or tree.name in self._mapping.functions or self._is_function(tree.name):
            return False
        return not _FLIES.match(tree.name) and not (is_repeated and tree.name.lower().endswith("run"))

    def _is_function(self, name: str) -> bool:
        return shape_of(name, self._sectors) is not None

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
                is_coordinate = part.name == WAYPOINTS and part.member in WAYPOINT_FIELDS
                return None if is_coordinate else (f"{part.name}[]", "no such array")
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
        known = (
            name in self._own
            or name in self.adopted
            or name in VARIABLES
            or name in CONSTANTS
            or name in self._mapping.variables
        )
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


def _has_no_effect(element: PlanElement, attribute: str, value: Expression) -> bool:
    """Whether an attribute is not looked at in flight: the pitch of a stage that holds an altitude or a climb."""
    is_lean = isinstance(element, AttitudeStage | ManualStage)
    return attribute == "pitch" and (not is_lean or value.tree == VariableName("auto"))


def _stores(part: object) -> Iterator[tuple[Target, Tree]]:
    """Everything that a part of a plan stores, and in what."""
    match part:
        case SetStage():
            yield part.var.tree, part.value.tree
        case Script():
            for instruction in part.instructions:
                if instruction.target is not None:
                    yield instruction.target, instruction.expression
        case PlanElement():
            for field in dataclasses.fields(part):
                for inner in _parts(getattr(part, field.name)):
                    yield from _stores(inner)
        case _:
            pass


def _parts(value: object) -> tuple[object, ...]:
    return value if isinstance(value, tuple) else (value,)
