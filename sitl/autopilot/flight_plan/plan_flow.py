"""Progress of a plan: block, step and their times, and the jumps between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from sitl.autopilot.flight_plan.steps import BlockStep, BlockSteps

__all__ = ["PlanFlow"]


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
