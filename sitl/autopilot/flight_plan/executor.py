"""Flies a flight plan: at every tick exceptions, then the stage in force, as the autopilots do that plans are made for.

Ticks are 20 a second of simulated time, however often the autopilot asks. A plan never raises: what cannot be evaluated
is said once and counts as false.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from protocol.flight_plans.evaluation import Scalar, UnknownNameError, evaluate
from protocol.flight_plans.expressions import ArrayItem, Script, Target, Tree, VariableName, expression_text
from protocol.flight_plans.flight_plan import (
    AbiBinding,
    CallOnceStage,
    CallStage,
    DerouteStage,
    EnuPoint,
    FlightPlan,
    ForStage,
    GoStage,
    PlanException,
    ReturnStage,
    SetStage,
    Stage,
    WhileStage,
)
from protocol.flight_plans.plan_check import PlanCheck
from protocol.flight_plans.plan_names import COORDINATES, WAYPOINT_FIELDS, NameMapping, block_number
from protocol.flight_plans.xml_elements import FlightPlanError
from sitl.autopilot.flight_plan.aims import Aim, AimKey, AimKind, BlockEntered, ExceptionFired, PlanEvent, PlanRemark
from sitl.autopilot.flight_plan.plan_functions import NameValues
from sitl.autopilot.flight_plan.plan_state import (
    BlockStep,
    MotorRequest,
    PlanFlow,
    PlanInputs,
    PlanMemory,
    StepKind,
    WaypointTable,
    compiled_blocks,
    condition_values,
    left_area,
)
from sitl.autopilot.flight_plan.stage_aims import StageAims

__all__ = ["PLAN_TICK", "FlightPlanExecutor"]

PLAN_TICK = 0.05  # [s]
MAX_STEPS = 500  # in one tick; a plan that jumps on without flying is stopped there
FOLLOWERS_AHEAD = 7  # that follow the present one
MAX_AIM_DISTANCE = 1e7  # what is farther is no place to fly to [m]
WHOLE_TYPES = frozenset(
    {"int", "bool", "bool_t", *(f"{sign}int{bits}_t" for sign in ("", "u") for bits in (8, 16, 32))}
)


class FlightPlanExecutor:
    """One plan in flight.

    After ``update``: ``aim`` is what it wants; ``take_motor_requests`` and ``take_events`` hand over what is new.

    Args:
        check: The plan, and what of it is not flown.
        inputs: The vehicle as it is now.
        mapping: What names of a build mean.
    """

    def __init__(self, check: PlanCheck, inputs: PlanInputs, mapping: NameMapping | None = None) -> None:
        self.check, self.plan = check, check.plan
        self.flow = PlanFlow(compiled_blocks(self.plan))
        self.memory = PlanMemory()
        self.waypoints = WaypointTable(self.plan)
        self.names = NameValues(self.plan, mapping or NameMapping(), self.memory, self.waypoints, self.flow, inputs)
        self.aim = Aim(AimKind.NOTHING)
        self._aims = StageAims(self.names)
        self._locked, self._left_out = check.locked_blocks, check.left_out
        self._events: list[PlanEvent] = []
        self._told: set[object] = set()
        self._ticked: float | None = None
        self._due = -math.inf  # time of the next tick [s]
        self._is_outside = False  # of the plan's area
        self._home_number = len(self.flow.blocks) - 1
        self._set_variables(self.plan)

    def take_events(self) -> list[PlanEvent]:
        """Events since the last call."""
        taken, self._events = self._events, []
        return taken

    def take_motor_requests(self) -> list[MotorRequest]:
        """The plan's requests to start or stop the motors since the last call."""
        taken, self.memory.motors = self.memory.motors, []
        return taken

    # The tick

    def update(self, inputs: PlanInputs, p: EnuPoint, v: EnuPoint) -> None:
        """Tick as often as simulated time asks for.

        Args:
            inputs: The vehicle as it is now.
            p: Where it is, of the plan's origin [m].
            v: Its velocity [m/s].
        """
        now = inputs.view.time
        if now < self._due - 1e-6:
            return
        self._due = (now if now - self._due > PLAN_TICK else self._due) + PLAN_TICK
        elapsed = 0.0 if self._ticked is None else now - self._ticked
        if self._ticked is None:
            self._begin(now)
        self._ticked, self.flow.time = now, now
        self.names.inputs, self.names.p, self.names.v = inputs, p, v
        if inputs.flying:
            self.memory.flight_time += elapsed
        self._tick()

    def jump(self, number: int) -> None:
        """Enter a block at once, by command."""
        self.flow.enter_block(number)
        self._entered("commanded")

    def remark(self, text: str, key: object) -> None:
        """Say something once in this block."""
        if key not in self._told:
            self._told.add(key)
            self._events.append(PlanRemark(self.flow.time, text))

    def _begin(self, now: float) -> None:
        self.flow.time = now
        self.flow.enter_block(self.flow.block, self.flow.stage)
        self._entered()

    def _entered(self, cause: str = "", line: int = 0) -> None:
        """Say which block is in force now and why, and why it is not flown if it is locked."""
        name = self.flow.present.name
        self._told.clear()
        self._events.append(BlockEntered(self.flow.time, self.flow.block, name, cause, line))
        if self.is_locked(self.flow.block):
            self.remark(f"Block {name} holds: {self._locked[name].construct} is not flown", "locked")

    def is_locked(self, number: int) -> bool:
        """Whether a block is not flown."""
        return number != self._home_number and self.flow.blocks[number].name in self._locked

    def _tick(self) -> None:
        leaves = self._leaves_its_area()
        if self._fires(self.plan.exceptions):
            return  # what the plan itself does about a vehicle that leaves comes first
        if leaves:
            self._jump_by(leaves, self.plan.place.line, self._home_number)
            return
        if self.is_locked(self.flow.block):
            self._hold("locked")
            return
        block, number = self.flow.present.block, self.flow.block
        entries = self.flow.entries
        if block is not None:
            self._run(block.pre_call)
            if self.flow.block != number or self._fires(block.exceptions):
                return
        step = self.flow.step
        if step is not None and self._fires(step.exceptions):
            return
        self._run_steps()
        if block is not None and (self.flow.block == number or self.flow.entries == entries):
            self._run(block.post_call)

    def _hold(self, why: str) -> None:
        """Stay where the vehicle is."""
        if self.aim.name != why or self.aim.kind is not AimKind.POINT:
            self.flow.entries += 1
            self.aim = Aim(AimKind.POINT, AimKey(self.flow.entries), end=self.names.p, name=why)

    def _leaves_its_area(self) -> str:
        """The reason why the vehicle leaves the plan's area at this tick; empty if it does not, or has left before."""
        reason = "" if self.names.inputs.view.landed else left_area(self.names)
        leaves = reason if not self._is_outside and self.flow.block != self._home_number else ""
        self._is_outside = bool(reason)
        return leaves

    def _fires(self, exceptions: Sequence[PlanException]) -> bool:
        """Jump if the condition of an exception holds, unless its block is in force."""
        for exception in exceptions:
            target = block_number(self.plan, exception.deroute.name)
            is_possible = target is not None and target != self.flow.block and exception.place not in self._left_out
            if target is None or not is_possible or not self._holds(exception.cond.tree):
                continue
            values = condition_values(exception.cond.tree, self.names)
            self._jump_by(exception.cond.text.strip(), exception.place.line, target, values)
            return True
        return False

    def _jump_by(self, text: str, line: int, target: int, values: str = "") -> None:
        before = self.flow.present.name
        self.flow.enter_block(target)
        self._events.append(ExceptionFired(self.flow.time, text, line, before, self.flow.present.name, values))
        self._entered()

    # Steps

    def _run_steps(self) -> None:
        """Go through as many steps as take no time."""
        for _ in range(MAX_STEPS):
            step = self.flow.step
            if step is None:
                over = self.flow.present.name
                self.flow.enter_next_block()
                self._entered(f"{over} is over")
                return
            if self._is_over(step):
                return
        self.remark(f"Block {self.flow.present.name} loops without flying: stopped there", "endless")

    def _is_over(self, step: BlockStep) -> bool:
        """Do one step; whether the tick ends with it."""
        stage = step.stage
        match step.kind:
            case StepKind.STAGE:
                return self._do(stage)
            case StepKind.AGAIN:
                self.flow.enter_step(step.jump)
                return False
            case StepKind.BEGIN_FOR if isinstance(stage, ForStage):
                self.names.loops[stage.var] = int(self._number(stage.from_value.tree)) - 1
                self._next()
                return False
            case StepKind.NEXT_FOR if isinstance(stage, ForStage):
                self.names.loops[stage.var] = int(self.names.loops[stage.var]) + 1
                goes_on = self.names.loops[stage.var] <= self._number(stage.to_value.tree)
            case _:
                goes_on = isinstance(stage, WhileStage) and (stage.cond is None or self._holds(stage.cond.tree))
        self.flow.enter_step(self.flow.stage + 1 if goes_on else step.jump)
        return goes_on

    def _next(self) -> None:
        self.flow.enter_step(self.flow.stage + 1)

    def _do(self, stage: Stage) -> bool:
        """Do a stage; whether the tick ends with it."""
        match stage:
            case SetStage():
                if stage.place not in self._left_out:
                    self._store(stage.var.tree, stage.value.tree)
                self._next()
                return False
            case CallOnceStage():
                return self._call_once(stage)
            case CallStage():
                return self._call(stage)
            case DerouteStage():
                target = block_number(self.plan, stage.block.name)
                over = self.flow.present.name
                self.flow.enter_block(self.flow.block if target is None else target)
                self._entered(f"deroute at the end of {over}", stage.place.line)
                return True
            case ReturnStage():
                reset = stage.reset_stage is not None and self._holds(stage.reset_stage.tree)
                over = self.flow.present.name
                self.flow.go_back(to_first_stage=reset)
                self._entered(f"return from {over}", stage.place.line)
                return True
            case _:
                return self._move(stage)

    def _call_once(self, stage: CallOnceStage) -> bool:
        entries = self.flow.entries
        self._fly(stage)
        if self.flow.entries == entries:
            self._next()
        return bool(stage.ends_tick)

    def _call(self, stage: CallStage) -> bool:
        if stage.until is not None and self._holds(stage.until.tree):
            self._next()
            return True
        self._aims.begin(self.flow.entries)
        if self._fly(stage) and stage.loop:
            return True
        self._next()
        return bool(stage.ends_tick)

    def _fly(self, stage: CallStage | CallOnceStage) -> bool:
        """Call what a stage names, and fly what a navigation routine wants; whether it goes on."""
        goes_on = self._run(stage.fun)
        wanted, self.memory.wanted = self.memory.wanted, None
        if wanted is None:
            return goes_on
        if not _is_finite(wanted):
            self.remark(f"<{stage.tag}> is not flown: it leads beyond all numbers", stage.place)
            self._hold("unknown")
            return goes_on
        self.aim = wanted
        return goes_on

    def _move(self, stage: Stage) -> bool:
        """Fly a stage for one tick; the tick ends here."""
        until = getattr(stage, "until", None)
        self._aims.begin(self.flow.entries)
        if until is not None and self._holds(until.tree):
            self._next()
            return True
        self._run(getattr(stage, "pre_call", None))
        try:
            aim = self._aims.aim(stage)
        except (FlightPlanError, UnknownNameError) as error:
            self.remark(f"<{stage.tag}> is not flown: {error}", stage.place)
            self._hold("unknown")
            return True
        if aim is None:
            self._next()
        elif not _is_finite(aim):
            self.remark(f"<{stage.tag}> is not flown: it leads beyond all numbers", stage.place)
            self._hold("unknown")
        else:
            if hindrance := self._aims.hindrance:
                self.remark(f"<{stage.tag}> holds: {hindrance}", (stage.place, hindrance))
            self.aim = aim._replace(followers=tuple(self._followers())) if isinstance(stage, GoStage) else aim
        self._run(getattr(stage, "post_call", None))
        return True

    def _followers(self) -> Iterator[EnuPoint]:
        """Ends of the legs that follow the present one without a stop."""
        steps, number = self.flow.present.steps, self.flow.stage + 1
        for _ in range(3 * FOLLOWERS_AHEAD):
            if number >= len(steps):
                return
            step = steps[number]
            if step.kind in {StepKind.AGAIN, StepKind.WHILE}:
                number = step.jump if step.kind is StepKind.AGAIN else number + 1
                continue
            stage = step.stage
            if not isinstance(stage, GoStage) or stage.hmode != "route" or stage.until is not None or stage.wp_qdr:
                return
            name = self.waypoints.known(stage.wp.name)
            if name is None or stage.vmode not in {None, "alt", "glide"}:
                return
            yield self.waypoints.at(name)
            number += 1

    # Expressions

    def _set_variables(self, plan: FlightPlan) -> None:
        """Give the plan's variables their first values."""
        self.memory.variables.update(dict.fromkeys(self.check.adopted, 0.0))
        for variable in plan.variables:
            if isinstance(variable, AbiBinding):
                for name in (variable.vars or "").split(","):
                    if name.strip():
                        self.memory.variables.setdefault(name.strip(), 0.0)
                continue
            if (variable.type or "float") in WHOLE_TYPES:
                self.memory.whole |= {variable.var}
            self.memory.variables[variable.var] = 0
            value = 0 if variable.init is None else self._number(variable.init.tree)
            self.names.store(variable.var, value)

    def _number(self, tree: Tree) -> Scalar:
        """The value of an expression; what has none is said once, and is 0."""
        try:
            return evaluate(tree, self.names)
        except FlightPlanError as error:
            self.remark(f"Cannot evaluate: {error}", error.place)
        except UnknownNameError as error:
            self.remark(f"Cannot evaluate: {error}", str(error))
        return 0

    def _holds(self, tree: Tree) -> bool:
        return self._number(tree) != 0

    def _store(self, target: Target, tree: Tree) -> None:
        try:
            match target:
                case VariableName():
                    self.names.store(target.name, self._number(tree))
                case ArrayItem():
                    coordinate = WAYPOINT_FIELDS.get(target.member, "")
                    self.names.move(self._number(target.index), coordinate, self._number(tree))
                case _:
                    coordinate = COORDINATES.get(target.name, "")
                    self.names.move(self._number(target.arguments[0]), coordinate, self._number(tree))
        except UnknownNameError as error:
            self.remark(str(error), expression_text(target))

    def _run(self, script: Script | None) -> bool:
        """Run statements; the value of the last one counts."""
        value: Scalar = 0
        for instruction in script.instructions if script is not None else ():
            if instruction.place in self._left_out:
                continue
            if instruction.condition is not None and not self._holds(instruction.condition):
                continue
            if instruction.target is not None:
                self._store(instruction.target, instruction.expression)
            else:
                value = self._number(instruction.expression)
        return value != 0


def _is_finite(aim: Aim) -> bool:
    values = (*aim.start, *aim.end, aim.radius, aim.course, aim.turn_rate, aim.climb or 0.0)
    return all(math.isfinite(value) and abs(value) < MAX_AIM_DISTANCE for value in values)
