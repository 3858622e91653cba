"""Charts by name: which expressions stand together, as the operator saved them, and some to begin with."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from platformdirs import user_state_path

from protocol.errors import FileError
from protocol.tools.files import read_toml, write_atomically

MAX_VIEWS_FILE = 1 << 18  # [byte]
MAX_CHARTS, MAX_CURVES = 12, 60  # of a view
MAX_NAME = 40  # of a view [characters]

Charts = tuple[tuple[str, ...], ...]


class ChartView(NamedTuple):
    """Charts under each other, each of several expressions."""

    name: str = ""
    charts: Charts = ()

    @property
    def expressions(self) -> tuple[str, ...]:
        """All of them, in order."""
        return tuple(text for chart in self.charts for text in chart)

    def with_expression(self, chart: int, text: str) -> ChartView:
        """With one more expression in a chart; in a new one behind the others if there is none of that number."""
        if chart >= len(self.charts):
            return self._replace(charts=(*self.charts, (text,)))
        changed = (*self.charts[chart], text)
        return self._replace(charts=(*self.charts[:chart], changed, *self.charts[chart + 1 :]))

    def without(self, chart: int, curve: int) -> ChartView:
        """Without an expression; an empty chart goes, too, and the name with the last one."""
        left = self.charts[chart][:curve] + self.charts[chart][curve + 1 :]
        charts = tuple(filter(None, (*self.charts[:chart], left, *self.charts[chart + 1 :])))
        return ChartView(self.name if charts else "", charts)


_BEGINNINGS: Mapping[str, Charts] = {
    "attitude": (
        ("deg(ATTITUDE.roll)", "deg(ATTITUDE.pitch)"),
        ("deg(ATTITUDE.yaw)",),
        ("deg(ATTITUDE.rollspeed)", "deg(ATTITUDE.pitchspeed)", "deg(ATTITUDE.yawspeed)"),
    ),
    "height and speed": (
        ("altitude",),  # above home, as the screens show it
        ("VFR_HUD.airspeed", "VFR_HUD.groundspeed", "VFR_HUD.climb"),
    ),
    "battery": (
        ("SYS_STATUS.voltage_battery", "SYS_STATUS.battery_remaining"),
        ("SYS_STATUS.current_battery",),
    ),
    "hybrid controller": (
        ("log10(DARKO_HYBRID_STATE.v_hover)", "log10(DARKO_HYBRID_STATE.v_forward)"),
        ("DARKO_ACTUATORS.motor_speed[0]", "DARKO_ACTUATORS.motor_speed[1]"),
        ("deg(DARKO_ACTUATORS.elevon[0])", "deg(DARKO_ACTUATORS.elevon[1])"),
    ),
}
BUILT_IN = {name: ChartView(name, charts) for name, charts in _BEGINNINGS.items()}


class ChartViews:
    """The views in a file, read once; those to begin with are always there.

    Args:
        file: By default ``chart-views.toml`` in the user's state folder, beside the plans opened lately.
    """

    def __init__(self, file: Path | None = None) -> None:
        self.file = file or user_state_path("darko") / "chart-views.toml"
        self._saved: dict[str, ChartView] | None = None

    def load(self) -> Mapping[str, ChartView]:
        """All views by name: saved ones, newest first, then those to begin with.

        Raises:
            FileError: The file cannot be read or has an error; the message says where.
        """
        saved = self._own()
        return saved | {name: view for name, view in BUILT_IN.items() if name not in saved}

    def view(self, name: str) -> ChartView:
        """A view by its name.

        Raises:
            FileError: There is none of this name, or the file has an error.
        """
        views = self.load()
        if name not in views:
            raise FileError(f"there is no view {name}: there is {', '.join(views)}")
        return views[name]

    def save(self, view: ChartView) -> None:
        """Keep a view under its name, in place of one of this name.

        Raises:
            FileError: The name makes no sense, or the file cannot be written or has an error: it stays as it is.
        """
        if not view.name or len(view.name) > MAX_NAME or not view.name.isprintable():
            raise FileError(f"a view has a name of 1 to {MAX_NAME} characters")
        self._write({view.name: view, **{name: other for name, other in self._own().items() if name != view.name}})

    def delete(self, name: str) -> None:
        """Forget a saved view.

        Raises:
            FileError: It was not saved, or the file cannot be written or has an error.
        """
        saved = self._own()
        if name not in saved:
            raise FileError(f"{name}: is no view that was saved")
        self._write({other: view for other, view in saved.items() if other != name})

    def _own(self) -> dict[str, ChartView]:
        if self._saved is None:
            self._saved = _parsed(self.file)
        return dict(self._saved)

    def _write(self, views: dict[str, ChartView]) -> None:
        lines = [f"{json.dumps(name)} = {json.dumps(view.charts)}\n" for name, view in views.items()]
        with contextlib.suppress(OSError):  # the write tells
            self.file.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(self.file, "".join(lines).encode())
        self._saved = views


def _parsed(file: Path) -> dict[str, ChartView]:
    content = read_toml(file, MAX_VIEWS_FILE)
    return {name: ChartView(name, _charts(file, name, value)) for name, value in content.items()}


def _charts(file: Path, name: str, value: Any) -> Charts:  # noqa: ANN401 - of the file
    charts = value if isinstance(value, list) else []
    curves = [text for chart in charts if isinstance(chart, list) for text in chart]
    is_right = bool(charts) and all(isinstance(chart, list) and chart for chart in charts)
    if not is_right or not all(isinstance(text, str) for text in curves):
        raise FileError(f"{file}: {name} is not a list of charts, each a list of expressions")
    if len(charts) > MAX_CHARTS or len(curves) > MAX_CURVES:
        raise FileError(f"{file}: {name} has more than {MAX_CHARTS} charts or {MAX_CURVES} expressions")
    return tuple(map(tuple, charts))
