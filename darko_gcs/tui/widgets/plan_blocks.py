"""The blocks of a flight plan as a list of buttons, grouped as the plan groups them."""

from __future__ import annotations

from rich.text import Text
from textual import on
from textual.message import Message
from textual.widgets import OptionList
from textual.widgets.option_list import Option

from darko_gcs.state.flight_plan_state import FlightPlanState, PlanButton

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
