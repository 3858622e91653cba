"""Charts of expressions, on a vehicle or a recording; views of them are kept by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.reactive import reactive

from darko_gcs.state.chart_views import MAX_CHARTS, MAX_CURVES, ChartView, ChartViews
from darko_gcs.state.field_history import ChartSource
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.tui.containment import StationScreen
from darko_gcs.tui.key_footer import KeyFooter
from darko_gcs.tui.own_keys import named_keys
from darko_gcs.tui.screens.dialogs import AskScreen, ChooseScreen, FormField
from darko_gcs.tui.widgets.charts_panel import ChartsPanel
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.errors import FileError
from protocol.flight_log.field_expressions import completions

EXAMPLE = "such as tilt, V or deg(ATTITUDE.roll); Tab completes; E, on the charts, lists all fields"


class ChartsScreen(StationScreen[None]):
    """The charts of a view.

    Args:
        source: Where curves come from.
        views: Where views are kept.
        view: The one that is shown.
        on_changed: Takes the view whenever it changes: it stays when the screen is left.
    """

    BINDINGS: ClassVar[list[BindingType]] = named_keys(
        "charts",
        [
            Binding("escape", "close", "Back", tooltip="Drop the cursor; without one, back to the flight"),
            Binding("a", "add", "Add", tooltip="Add an expression to the chosen chart"),
            Binding("c", "new_chart", "New chart", tooltip="Begin another chart"),
            Binding("enter", "edit", "Edit", tooltip="Change the chosen expression", show=False),
            Binding("delete,backspace", "remove", "Remove", tooltip="Remove the chosen expression", key_display="del"),
            Binding("question_mark", "app.act('help')", "Help", key_display="?", tooltip="These keys"),
            Binding("o", "open", "Open", tooltip="Open a view"),
            Binding("s", "save", "Save", tooltip="Keep these charts as a view"),
            Binding("D", "forget", "", tooltip="Delete a view that was saved", show=False),
            Binding("space", "pause", "Pause", tooltip="Stand still, or follow the vehicle"),
            Binding(
                "left", "cursor(-1)", "Cursor", key_display="← →", tooltip="Move the cursor; a click puts it there"
            ),
            Binding("right", "cursor(1)", show=False),
            Binding("up", "choose(-1)", "Choose", key_display="↑ ↓", tooltip="Choose another curve", show=False),
            Binding("down", "choose(1)", show=False),
            Binding(
                "less_than_sign",
                "pan(-1)",
                "Earlier",
                key_display="< >",
                tooltip="Show an earlier or a later time",
                show=False,
            ),
            Binding("greater_than_sign", "pan(1)", show=False),
        ],
    )
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(
        self, source: ChartSource, views: ChartViews, view: ChartView, on_changed: Callable[[ChartView], None]
    ) -> None:
        super().__init__()
        self._source, self._views, self._on_changed = source, views, on_changed
        self.charts = ChartsPanel(source, view)

    def compose(self) -> ComposeResult:
        """Status bar, charts, footer."""
        yield StatusBar().data_bind(ChartsScreen.snapshot, ChartsScreen.now)
        yield self.charts.data_bind(ChartsScreen.snapshot, ChartsScreen.now)
        yield KeyFooter()

    def on_mount(self) -> None:
        """Name the view."""
        self._tell()

    @property
    def view(self) -> ChartView:
        """The view that is shown."""
        return self.charts.view

    def add_expression(self, text: str) -> str | None:
        """Draw another expression in the chosen chart; returns why not, if it cannot be."""
        return self._add(self.charts.place()[0], text)

    def action_close(self) -> None:
        """Drop the cursor; without one, back."""
        if self.charts.cursor is not None:
            self.charts.drop_cursor()
        else:
            self.dismiss(None)

    def action_add(self) -> None:
        """Ask for an expression of the chosen chart."""
        self._ask("Add to the chart", "", self.add_expression)

    def action_new_chart(self) -> None:
        """Ask for the first expression of another chart."""
        self._ask("Another chart", "", lambda text: self._add(len(self.view.charts), text))

    def action_edit(self) -> None:
        """Ask for another text of the chosen expression."""
        chart, curve = self.charts.place()
        if chart >= len(self.view.charts):
            self.action_add()
            return

        def changed(text: str) -> str | None:
            if problem := self._problem(text):
                return problem
            charts = [list(texts) for texts in self.view.charts]
            charts[chart][curve] = text
            self._show(self.view._replace(charts=tuple(map(tuple, charts))))
            return None

        self._ask("Change the expression", self.view.charts[chart][curve], changed)

    def action_remove(self) -> None:
        """Remove the chosen expression."""
        chart, curve = self.charts.place()
        if chart < len(self.view.charts):
            self._show(self.view.without(chart, curve))

    def action_open(self) -> None:
        """Choose a view."""
        self._choose("Open a view", self._show)

    def action_forget(self) -> None:
        """Choose a saved view that is deleted."""
        self._choose("Delete a view", lambda view: self._told(lambda: self._views.delete(view.name), "deleted"))

    def action_save(self) -> None:
        """Ask for a name, and keep the view."""

        def check(texts: tuple[str, ...]) -> str | None:
            try:
                self._views.save(self.view._replace(name=texts[0]))
            except FileError as error:
                return str(error)
            self._show(self.view._replace(name=texts[0]))
            self.notify(f"View {texts[0]} saved: darko-gcs log plot FILE --view '{texts[0]}' draws it", markup=False)
            return None

        fields = [FormField("Name", self.view.name, "For o here, and for --view NAME of log plot and log report")]
        self.app.push_screen(AskScreen("Keep these charts", fields, check))

    def action_pause(self) -> None:
        """Stand still, or go on."""
        self.charts.pause()

    def action_cursor(self, columns: int) -> None:
        """Move the cursor."""
        self.charts.move_cursor(columns)

    def action_choose(self, step: int) -> None:
        """Choose another curve."""
        self.charts.choose(step)

    def action_pan(self, step: int) -> None:
        """Show another time."""
        self.charts.pan(step)

    # Inside

    def _ask(self, title: str, text: str, take: Callable[[str], str | None]) -> None:
        self.app.push_screen(
            AskScreen(
                f"{title}: {EXAMPLE}",
                [FormField("Expression", text, "MESSAGE.field, or several with + - * / and functions (?)")],
                lambda texts: take(texts[0]),
                complete=lambda typed: completions(typed, self._source.names),
            )
        )

    def _add(self, chart: int, text: str) -> str | None:
        if problem := self._problem(text):
            return problem
        if len(self.view.expressions) >= MAX_CURVES or chart >= MAX_CHARTS:
            return f"no more than {MAX_CURVES} expressions in {MAX_CHARTS} charts"
        self._show(self.view.with_expression(chart, text))
        first = sum(map(len, self.view.charts[:chart]))
        self.charts.choose(first + len(self.view.charts[chart]) - 1 - self.charts.chosen)
        return None

    def _problem(self, text: str) -> str | None:
        """The error in an expression; also that the vehicle does not send what it names."""
        try:
            self._source.curve(text)
        except FileError as error:
            return str(error)
        return None

    def _choose(self, title: str, then: Callable[[ChartView], object]) -> None:
        try:
            views = list(self._views.load().values())
        except FileError as error:
            self.notify(str(error), severity="warning", markup=False)
            return
        rows = [f"{view.name}: {'; '.join(', '.join(chart) for chart in view.charts)}" for view in views]

        def chosen(at: int | None) -> None:
            if at is not None:
                then(views[at])

        self.app.push_screen(ChooseScreen(title, rows), chosen)

    def _told(self, change: Callable[[], None], done: str) -> None:
        try:
            change()
        except FileError as error:
            self.notify(str(error), severity="warning", markup=False)
        else:
            self.notify(f"The view is {done}")

    def _show(self, view: ChartView) -> None:
        self.charts.show(view)
        self._on_changed(view)
        self._tell()

    def _tell(self) -> None:
        self.charts.border_title = f"Charts: {self.view.name}" if self.view.name else "Charts"
