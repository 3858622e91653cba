"""A plan in flight, as its variables and functions see it, with their arguments as numbers and waypoints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Final, NamedTuple, Protocol

from protocol.flight_plans.attributes import attribute_texts
from protocol.flight_plans.evaluation import Argument, NameTable, Scalar, UnknownNameError, evaluate
from protocol.flight_plans.expressions import Call, LoopVariable, Member, Tree, VariableName, expression_text, walk
from protocol.flight_plans.flight_plan import (
    HOME_WAYPOINT,
    EnuPoint,
    FlightPlan,
    ForStage,
    GoStage,
    HomeStage,
    PathStage,
    PlanBlock,
    PlanException,
    Stage,
    WhileStage,
    inside_polygon,
    waypoint_position,
)
from protocol.flight_plans.plan_names import NAV_CLIMB, NAV_DESCENT, NameMapping, plan_constants
from protocol.flight_plans.xml_elements import FlightPlanError
from sitl.autopilot.flight_plan.aims import PLAN_ORIGIN, Aim, away, bearing_between
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import World
from sitl.control.reference import Point
from sitl.guidance.view import VehicleView
from sitl.prediction.chooser import Chooser

# Other aircraft that were heard on the link: what a plan may follow.


MAX_AIRCRAFT = 32  # that are remembered
LOST_AFTER = 3.0  # of silence [s]
STEADY_SPEED = 0.5  # above which an aircraft's velocity tells its course [m/s]


class HeardAircraft(NamedTuple):
    """Last reported position of another aircraft."""

    time: float  # when that was heard [s]
    p: Point  # world NWU [m]
    v: Point  # [m/s]
    course: float | None = None  # clockwise from north [rad]; None: it has not moved since it was first heard


@dataclass(slots=True)
class OtherAircraft:
    """The newest place of every aircraft, by its system id."""

    heard: dict[int, HeardAircraft] = field(default_factory=dict)

    def take(self, system: int, time: float, p: Point, v: Point) -> None:
        """An aircraft tells where it is; beyond so many of them the one that was silent longest is forgotten.

        Args:
            system: Its system id.
            time: Of arrival [s].
            p: Where it is, world NWU [m].
            v: Its velocity [m/s].
        """
        last = self.heard.pop(system, None)
        if last is None and len(self.heard) >= MAX_AIRCRAFT:
            del self.heard[min(self.heard, key=lambda other: self.heard[other].time)]
        moves = math.hypot(v[0], v[1]) > STEADY_SPEED
        course = math.atan2(-v[1], v[0]) if moves else (last.course if last is not None else None)
        self.heard[system] = HeardAircraft(time, p, v, course)

    def at(self, system: float, now: float) -> HeardAircraft | None:
        """An aircraft where it is by now [s] if it goes on as it did; None if it is not heard."""
        last = self.heard.get(round(system)) if math.isfinite(system) else None
        if last is None or now - last.time > LOST_AFTER:
            return None
        age = max(now - last.time, 0.0)
        x, y, z = (place + age * speed for place, speed in zip(last.p, last.v, strict=True))
        return last._replace(p=(x, y, z))


# The waypoints of a plan as they are now: moved by the plan, or by its operator.


class WaypointTable:
    """Positions by name and number; number 0 is none of them, as in the autopilots that plans are written for."""

    def __init__(self, plan: FlightPlan) -> None:
        self._plan = plan
        self.names = tuple(point.name for point in plan.waypoints)
        self._positions = {point.name: waypoint_position(plan, point) for point in plan.waypoints}

    def number(self, name: str) -> int:
        """The number of a waypoint."""
        return self.names.index(name) + 1

    def name_of(self, number: float) -> str | None:
        """The name of a numbered waypoint; None: there is none."""
        index = round(number) - 1 if math.isfinite(number) else -1
        return self.names[index] if 0 <= index < len(self.names) else None

    def known(self, name: str) -> str | None:
        """The name a waypoint has here; that of a procedure may be ``PROCEDURE.name``."""
        point = self._plan.waypoint(name)
        return None if point is None else point.name

    def at(self, name: str) -> EnuPoint:
        """Position of a waypoint."""
        return self._positions[name]

    @property
    def home(self) -> EnuPoint:
        """Position of HOME."""
        return self._positions[HOME_WAYPOINT]

    def move(self, name: str, to: EnuPoint) -> None:
        """Put a waypoint elsewhere."""
        self._positions[name] = to

    def corners(self, sector: str) -> list[tuple[float, float]]:
        """The outline of a sector as its corners are now, east and north [m]."""
        found = self._plan.sector(sector)
        corners = () if found is None else found.corners
        names = [self.known(corner.name) for corner in corners]
        return [self._positions[name][:2] for name in names if name is not None]


# A block as a list of steps: its stages one after the other, with loops as jumps.


SHARED = {
    *("vmode", "alt", "height", "climb", "throttle", "pitch", "until"),
    *("pre_call", "post_call", "nav_type", "nav_params"),
}


class StepKind(Enum):
    """Kind of a step."""

    STAGE = auto()
    WHILE = auto()  # goes on, or jumps behind its loop
    BEGIN_FOR = auto()  # sets the counter before its first value
    NEXT_FOR = auto()  # counts, and goes on or jumps behind its loop
    AGAIN = auto()  # jumps to the head of its loop


@dataclass(frozen=True, slots=True)
class BlockStep:
    """One step."""

    kind: StepKind
    stage: Stage
    jump: int = 0  # number of another step
    exceptions: tuple[PlanException, ...] = ()  # of the loops around


@dataclass(frozen=True, slots=True)
class BlockSteps:
    """A block that can be flown step by step."""

    name: str
    steps: tuple[BlockStep, ...]
    block: PlanBlock | None = None  # None: the block HOME that every plan has


def compiled_blocks(plan: FlightPlan) -> tuple[BlockSteps, ...]:
    """The blocks of a plan, HOME behind them."""
    blocks = [BlockSteps(block.name, tuple(_steps(block.stages)), block) for block in plan.blocks]
    return (*blocks, BlockSteps("HOME", (BlockStep(StepKind.STAGE, HomeStage()),)))


def stage_text(stage: Stage) -> str:
    """A stage in one line, for an operator: what it alone has before what all stages of movement have."""
    texts = sorted(attribute_texts(stage).items(), key=lambda item: item[0] in SHARED)
    return " ".join((stage.tag, *(f"{name}={text}" for name, text in texts)))


def _steps(stages: Sequence[Stage]) -> list[BlockStep]:
    steps: list[BlockStep] = []
    _add(steps, stages, ())
    return steps


def _add(steps: list[BlockStep], stages: Sequence[Stage], exceptions: tuple[PlanException, ...]) -> None:
    for stage in stages:
        match stage:
            case WhileStage():
                _add_loop(steps, stage, StepKind.WHILE, exceptions)
            case ForStage():
                steps.append(BlockStep(StepKind.BEGIN_FOR, stage, exceptions=exceptions))
                _add_loop(steps, stage, StepKind.NEXT_FOR, exceptions)
            case PathStage():
                steps += [BlockStep(StepKind.STAGE, leg, exceptions=exceptions) for leg in _legs(stage)]
            case _:
                steps.append(BlockStep(StepKind.STAGE, stage, exceptions=exceptions))


def _add_loop(
    steps: list[BlockStep], stage: WhileStage | ForStage, kind: StepKind, exceptions: tuple[PlanException, ...]
) -> None:
    head, inner = len(steps), (*exceptions, *stage.exceptions)
    steps.append(BlockStep(kind, stage, exceptions=exceptions))
    _add(steps, stage.stages, inner)
    steps.append(BlockStep(StepKind.AGAIN, stage, head, inner))
    steps[head] = BlockStep(kind, stage, len(steps), exceptions)


def _legs(path: PathStage) -> list[GoStage]:
    """The legs of a path: each from one of its waypoints to the next."""
    return [
        GoStage(
            place=path.place,
            wp=there,
            from_wp=here,
            hmode="route",
            vmode=path.vmode,
            alt=path.alt,
            climb=path.climb,
            throttle=path.throttle,
            approaching_time=path.approaching_time,
            exceeding_time=path.exceeding_time,
        )
        for here, there in zip(path.wpts[:-1], path.wpts[1:], strict=True)
    ]


NOBODY = OtherAircraft()


@dataclass(frozen=True, slots=True)
class PlanFrame:
    """Frame of the plan: its origin in the world frame NWU."""

    east: float = 0.0
    north: float = 0.0

    def to_world(self, p: EnuPoint) -> Point:
        """World NWU [m]."""
        return (p.y + self.north, -(p.x + self.east), p.z)

    def to_plan(self, p: Point) -> EnuPoint:
        """East, north and up of the plan's origin [m]."""
        return EnuPoint(-p[1] - self.east, p[0] - self.north, p[2])

    @staticmethod
    def turned(v: Point) -> EnuPoint:
        """A velocity east, north and up [m/s]."""
        return EnuPoint(-v[1], v[0], v[2])


class MotorRequest(Enum):
    """A plan's request to the motors."""

    START = auto()
    STOP = auto()


class PlanInputs(NamedTuple):
    """The vehicle and its autopilot, as they are at one tick."""

    view: VehicleView
    world: World
    settings: Settings
    chooser: Chooser | None = None  # None: every leg is hovered
    armed: bool = False
    flying: bool = False  # whether it is to be in the air
    datalink_time: float = 0.0  # since the ground station was heard [s]
    stick_velocity: Point = (0.0, 0.0, 0.0)  # that the sticks ask for, world NWU [m/s]; zero without any
    radio_lost: bool = False  # sticks were heard, and stopped
    others: OtherAircraft = NOBODY  # that may be followed
    frame: PlanFrame = PlanFrame()  # where the plan lies


FIRST_VALUES: Final[Mapping[str, Scalar]] = {
    "sweep": 25.0,  # between the lines of a survey [m]
    "nav_takeoff_direction": 0.0,
    "nav_climb": 0.0,
    "fp_pitch": 0.0,
    "fp_throttle": 0.0,
    "fp_climb": 0.0,
    "rectangle_survey_sweep_num": 0,
    "PolySurveySweepNum": 0,
    "PolySurveySweepBackNum": 0,
}
MIN_COUNTED_SHARE = 0.3  # of a radius: nearer to the centre, a bearing from it is chance
HOVER_THROTTLE = 0.5  # share of full throttle that neither climbs nor sinks
THROTTLE_CLIMB = 4.0  # vertical speed by throttle beyond that [m/s]


@dataclass(slots=True)
class CircleCount:
    """Turns about a centre since the stage began."""

    turned: float = 0.0  # clockwise [rad]
    qdr: float = 0.0  # bearing from the centre [rad]
    _is_begun: bool = False

    def update(self, centre: EnuPoint, p: EnuPoint, radius: float) -> None:
        """One tick about a centre."""
        qdr, away = bearing_between(centre, p), math.hypot(p.x - centre.x, p.y - centre.y)
        if self._is_begun and away >= MIN_COUNTED_SHARE * abs(radius):
            self.turned += math.remainder(qdr - self.qdr, math.tau)
        self.qdr, self._is_begun = qdr, True


@dataclass(slots=True)
class RoutineMemory:
    """Memory of the navigation routines from call to call."""

    pattern: object = None  # what is flown: of a line, a flower, a survey, a take-off or a landing
    waypoints: tuple[str, ...] = ()  # that a set-up named
    part: int = -1  # of the pattern
    begun: int = 0  # parts of all patterns
    called: float = -math.inf  # when a take-off or landing was called last [s]


@dataclass(slots=True)
class PlanMemory:
    """Variables of the plan and of the autopilot that a plan can change."""

    variables: dict[str, Scalar] = field(default_factory=dict)  # of the plan
    whole: frozenset[str] = frozenset()  # those of them that hold whole numbers
    radius: float | None = None  # nav.radius [m]; None: that of the settings
    climb_speed: float = NAV_CLIMB  # [m/s]
    descent_speed: float = NAV_DESCENT  # [m/s]
    heading: float | None = None  # clockwise from north [rad]; None: the vehicle's own
    max_speed: float | None = None  # of the hover [m/s]; None: that of the settings
    forces_forward: bool = False  # legs are flown forward where possible
    throttle: float = 0.0  # that of the last aim, 0..1
    baseleg_qdr: float = 0.0  # [rad]
    ground_height: float = 0.0  # of the ground reference above the plan's ground [m]
    altitude_shift: float = 0.0  # of the altitude reference [m]
    detects_ground: bool = False
    circle: CircleCount = field(default_factory=CircleCount)
    last_point: EnuPoint = PLAN_ORIGIN  # where the last leg ended
    flight_time: float = 0.0  # [s]
    motors: list[MotorRequest] = field(default_factory=list)  # asked for since the last look
    routines: RoutineMemory = field(default_factory=RoutineMemory)
    wanted: Aim | None = None  # by a navigation routine, until the executor takes it
    extras: dict[str, Scalar] = field(default_factory=lambda: dict(FIRST_VALUES))  # variables without an effect here


@dataclass(slots=True)
class PlanFlow:
    """The block and step in force. The owner sets ``time`` at every tick.

    Attributes:
        blocks: All of them, HOME last.
        time: Of this tick [s].
        block: Number of the block in force.
        stage: Number of its step in force.
        entries: How often a step was entered: tells a stage from the same one entered anew.
    """

    blocks: Sequence[BlockSteps]
    time: float = 0.0
    block: int = 0
    stage: int = 0
    entries: int = 1
    _block_since: float = 0.0
    _stage_since: float = 0.0
    _left: tuple[int, int] = field(default=(0, 0))  # block and step before the last jump

    @property
    def block_time(self) -> float:
        """In the block [s]."""
        return self.time - self._block_since

    @property
    def stage_time(self) -> float:
        """In the stage [s]."""
        return self.time - self._stage_since

    @property
    def present(self) -> BlockSteps:
        """The block in force."""
        return self.blocks[self.block]

    @property
    def step(self) -> BlockStep | None:
        """The step in force; None behind the last."""
        steps = self.present.steps
        return steps[self.stage] if self.stage < len(steps) else None

    def enter_step(self, number: int) -> None:
        """Begin a step of the block."""
        self.stage, self._stage_since = number, self.time
        self.entries += 1

    def enter_block(self, number: int, stage: int = 0) -> None:
        """Jump to a block, and remember which was left."""
        if number != self.block:
            self._left = (self.block, self.stage)
        self.block, self._block_since = number, self.time
        self.enter_step(stage)

    def go_back(self, *, to_first_stage: bool) -> None:
        """Jump to where the last jump began."""
        block, stage = self._left
        self.enter_block(block, 0 if to_first_stage else stage)

    def enter_next_block(self) -> None:
        """Go on behind the last step: the next block, or the last one again."""
        self.enter_block(min(self.block + 1, len(self.blocks) - 1))


READERS = ("Get", "stateGet")  # functions whose names begin so change nothing: they may be asked twice


def condition_values(tree: Tree, names: NameTable) -> str:
    """Values that the condition read, such as ``GetPosHeight() 1.52, laps 2``; empty if it read none that can be told.

    Args:
        tree: The condition.
        names: What its names mean now.
    """
    told: dict[str, str] = {}
    for part in walk(tree):
        if not _is_read(part):
            continue
        try:
            told[expression_text(part)] = f"{evaluate(part, names):.4g}"
        except (FlightPlanError, UnknownNameError):
            continue
    return ", ".join(f"{text} {value}" for text, value in told.items())


def _is_read(part: Tree) -> bool:
    match part:
        case VariableName():
            return not part.name.isupper()  # those are constants
        case LoopVariable():
            return True
        case Call():
            return part.name.startswith(READERS)
        case Member():
            return part.call.name.startswith(READERS)
        case _:
            return False


class PlanPosition(Protocol):
    """Progress of a plan: block and step in force, and their times."""

    @property
    def block(self) -> int:
        """Number of the block in force."""

    @property
    def stage(self) -> int:
        """Number of the step in force."""

    @property
    def block_time(self) -> float:
        """In the block [s]."""

    @property
    def stage_time(self) -> float:
        """In the stage [s]."""


class PlanState:
    """One plan in flight, and its vehicle.

    Attributes:
        plan: The plan.
        mapping: What names of its build mean.
        constants: Its names with a value that stays.
        inputs: The vehicle at this tick.
        memory: What the plan has set.
        waypoints: Where they are.
        position: Where the plan is.
        p: Where the vehicle is, of the plan's origin.
        v: Its velocity, east, north and up [m/s].
        loops: The counters of loops.
    """

    def __init__(
        self,
        plan: FlightPlan,
        mapping: NameMapping,
        memory: PlanMemory,
        waypoints: WaypointTable,
        position: PlanPosition,
        inputs: PlanInputs,
    ) -> None:
        self.plan, self.mapping, self.constants = plan, mapping, plan_constants(plan)
        self.memory, self.waypoints, self.position, self.inputs = memory, waypoints, position, inputs
        self.loops: dict[str, Scalar] = {}
        self.p = self.v = EnuPoint(0.0, 0.0, 0.0)

    @property
    def height(self) -> float:
        """Of the vehicle above the ground reference [m]."""
        return self.p.z - self.memory.ground_height

    @property
    def altitude(self) -> float:
        """Of the vehicle above the sea, as the plan counts it [m]."""
        return self.plan.ground_alt + self.p.z + self.memory.altitude_shift


def left_area(state: PlanState) -> str:
    """Beyond which of the plan's limits the vehicle is; empty: within all."""
    plan, p = state.plan, state.p
    if away(p, state.waypoints.home) > plan.max_dist_from_home:
        return f"farther than {plan.max_dist_from_home:g} m from HOME"
    if plan.geofence_max_height is not None and state.height > plan.geofence_max_height:
        return f"higher than {plan.geofence_max_height:g} m"
    if plan.geofence_max_alt is not None and state.altitude > plan.geofence_max_alt:
        return f"above {plan.geofence_max_alt:g} m"
    sector = plan.geofence_sector
    if sector is not None and not inside_polygon(state.waypoints.corners(sector.name), p.x, p.y):
        return f"outside {sector.name}"
    return ""


def number(argument: Argument) -> Scalar:
    """An argument that is a number; raises UnknownNameError, as the others do."""
    if isinstance(argument, str):
        raise UnknownNameError(f"{argument!r} is not a number")
    return argument


def waypoint_name(state: PlanState, argument: Argument) -> str:
    """The name of a waypoint that is given by its number."""
    name = state.waypoints.name_of(number(argument))
    if name is None:
        raise UnknownNameError(f"there is no waypoint {argument}")
    return name


def named_point(state: PlanState, argument: Argument) -> EnuPoint:
    """Position of a waypoint that is given by its number."""
    return state.waypoints.at(waypoint_name(state, argument))
