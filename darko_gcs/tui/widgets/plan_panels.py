"""Panels of a flight plan: its blocks as buttons, and its state with block, stage, times and events."""

from __future__ import annotations

from textwrap import wrap

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.message import Message
from textual.widgets import OptionList
from textual.widgets.option_list import Option

from darko_gcs.state.flight_plan_state import FlightPlanState, PlanButton, PlanHappening
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import format_time
from darko_gcs.tui.containment import on
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import MIN_WRAP_WIDTH, Panel, styled_line
from protocol.dialect.vocabulary import PlanEventKind

OTHER_BLOCKS = "other blocks"  # heading of those without a group


def grouped_blocks(plan: FlightPlanState) -> list[tuple[str, list[PlanButton]]]:
    """Groups in the order of their first block, those without one last; each with its blocks in the plan's order."""
    groups: dict[str, list[PlanButton]] = {}
    for button in plan.blocks.values():
        groups.setdefault(button.group, []).append(button)
    rest = groups.pop("", [])
    return [*groups.items(), *([(OTHER_BLOCKS if groups else "", rest)] if rest else [])]


def key_name(text: str) -> str:
    """The name of a key as the terminal tells it: "t", "T", "f5", "ctrl+k"; empty for one that it cannot tell.

    Plans write "t", "F5", "Ctrl+k" or "<Control>k".
    """
    plain = text.strip().replace("<Control>", "ctrl+").replace("<Ctrl>", "ctrl+")
    if len(plain) == 1:
        return plain if plain.isalnum() else ""
    lower = plain.lower()
    is_function_key = lower[:1] == "f" and lower[1:].isdigit()
    is_control = lower.startswith("ctrl+") and len(lower) == len("ctrl+") + 1 and lower[-1].isalnum()
    return lower if is_function_key or is_control else ""


class PlanBlockList(OptionList):
    """The list; ``Chosen`` tells that a block was chosen with Enter or the mouse."""

    class Chosen(Message):
        """A block was chosen."""

        def __init__(self, number: int) -> None:
            super().__init__()
            self.number = number

    def __init__(self, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(id=id, compact=True, markup=False)
        self._shown: tuple[object, ...] = ()

    def show(self, plan: FlightPlanState | None) -> None:
        """Show the blocks, and mark the one in force."""
        shown = () if plan is None else (tuple(plan.blocks.values()), plan.block)
        if shown == self._shown:
            return
        same_rows = len(shown) == len(self._shown) == 2 and shown[0] == self._shown[0]
        self._shown = shown
        if plan is None:
            self.clear_options()
        elif same_rows:
            for button in plan.blocks.values():
                self.replace_option_prompt(str(button.number), _row(button, plan.block))
        else:
            self._fill(plan)

    def _fill(self, plan: FlightPlanState) -> None:
        kept = None if self.highlighted is None else self.get_option_at_index(self.highlighted).id
        self.clear_options()
        for group, buttons in grouped_blocks(plan):
            if group:
                self.add_option(Option(Text(f"── {group} ", style="dim"), disabled=True))
            for button in buttons:
                self.add_option(Option(_row(button, plan.block), id=str(button.number)))
        wanted = kept if kept in {str(number) for number in plan.blocks} else str(plan.block)
        if any(option.id == wanted for option in self.options):
            self.highlighted = self.get_option_index(wanted)

    @on(OptionList.OptionSelected)
    def _selected(self, event: OptionList.OptionSelected) -> None:
        event.stop()
        if event.option_id is not None:
            self.post_message(self.Chosen(int(event.option_id)))


def _row(button: PlanButton, present: int) -> Text:
    mark = "▶" if button.number == present else "✗" if button.locked else " "
    style = "bold" if button.number == present else "dim" if button.locked or not button.has_button else ""
    return Text(f"{mark}{key_name(button.key):>2} {button.label}", style=style, no_wrap=True, overflow="ellipsis")


NO_PLAN = (
    "The vehicle has no flight plan, or has not sent it yet (F5 asks again)",
    "Ctrl+O loads one from a file (.xml) onto a vehicle that stands on the ground",
)
NO_RECORDED_PLAN = ("No flight plan in the recording so far",)
HAPPENING_STYLES = {PlanEventKind.EXCEPTION: "warn", PlanEventKind.REMARK: "accent"}


class PlanHeadPanel(Panel):
    """Two lines: the plan with its block, and the stage."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - two lines
        """The block with its time, then the stage with its own."""
        plan = s.flight_plan
        if plan is None:
            return [styled_line((line, "dim")) for line in (NO_RECORDED_PLAN if s.session.is_replay else NO_PLAN)]
        flown = ("flown", "good") if s.flies_plan else (f"not flown: {s.status.mode or 'mode unknown'}", "warn")
        block = styled_line(
            (f"{plan.block} {plan.block_name(plan.block)}", "accent"),
            f"  {format_time(plan.block_time)}   ",
            flown,
            ("" if plan.is_complete else f"   {plan.received} of {plan.entries} entries", "dim"),
            (f"   {plan.name}   in flight {format_time(plan.flight_time)}", "dim"),
        )
        line = f"   line {plan.line}" if plan.line else ""
        stage = styled_line(
            f"{plan.stage} {plan.stage_text or 'no stage'}", f"  {format_time(plan.stage_time)}", (line, "dim")
        )
        return [block, stage]


class PlanEventPanel(Panel):
    """Events of the flight plan, newest last: blocks entered, exceptions that fired, remarks."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """As many lines as fit; long ones take several rows."""
        plan = s.flight_plan
        if plan is None:
            return []
        rows: list[StyledLine] = []
        for happening in plan.happenings[-height:]:
            style = HAPPENING_STYLES.get(PlanEventKind(happening.kind), "") if _is_known(happening) else ""
            parts = wrap(happening_text(plan, happening), max(width, MIN_WRAP_WIDTH), subsequent_indent="  ")
            rows += [styled_line((part, style)) for part in parts]
        return rows[-height:]


def happening_text(plan: FlightPlanState, h: PlanHappening) -> str:
    """One line about what happened: "1:23.4 Route -> Standby: datalink_time > 10 (line 37)"."""
    line = f" (line {h.line})" if h.line else ""
    if h.kind == PlanEventKind.EXCEPTION:
        what = f"{plan.block_name(h.from_block)} -> {plan.block_name(h.to_block)}: {h.text}{line}"
    elif h.kind == PlanEventKind.BLOCK:
        what = f"block {h.text}{line}"
    else:
        what = h.text
    return f"{format_time(h.time)} {what}"


def _is_known(happening: PlanHappening) -> bool:
    return happening.kind in set(PlanEventKind)


class FlownPlan(Vertical):
    """Shows where the plan is; nothing here has the focus, so no key is taken from the flight."""

    def __init__(self, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(id=id)
        self._head, self._blocks = (
            PlanHeadPanel("Flight plan", id="flown-plan-head"),
            PlanBlockList(id="flown-plan-blocks"),
        )
        self._blocks.can_focus = False

    def compose(self) -> ComposeResult:
        """Block and stage, then the blocks."""
        yield self._head
        yield self._blocks

    def show(self, s: Snapshot, now: float) -> None:
        """Show a snapshot, if there is a plan and room for it."""
        if s.flight_plan is None or not self.is_mounted or not self.display:
            return
        self._head.now, self._head.snapshot = now, s
        self._blocks.show(s.flight_plan)
