"""A block as a list of steps: its stages one after the other, with loops as jumps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto

from protocol.flight_plans.attributes import attribute_texts
from protocol.flight_plans.flight_plan import (
    FlightPlan,
    ForStage,
    GoStage,
    HomeStage,
    PathStage,
    PlanBlock,
    PlanException,
    Stage,
    WhileStage,
)

__all__ = ["BlockStep", "BlockSteps", "StepKind", "compiled_blocks", "stage_text"]


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
