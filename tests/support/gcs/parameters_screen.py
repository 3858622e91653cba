"""The parameters screen in tests: a vehicle with a tuned gain, a list, a mask, and a name like markup."""

from darko_gcs.state.parameters import ParameterMetadata
from darko_gcs.tui.screens.parameters_screen import ParametersScreen
from protocol.dialect import mavlink
from tests.support.gcs.screens import screen_text, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with

GAIN = ParameterMetadata(text="Position gain", unit="N/m", minimum=0.1, maximum=3.0, default=1.2)
ACTION = ParameterMetadata(
    text="Ground station lost", minimum=0.0, maximum=3.0, default=0.0, is_integer=True, needs_reboot=True,
    values=((0.0, "go on"), (1.0, "hold"), (2.0, "return"), (3.0, "land")),
)  # fmt: skip
AIDS = ParameterMetadata(text="Aids in use", default=1.0, is_integer=True, bits=((0, "GPS"), (1, "baro"), (4, "flow")))
TUNED = snapshot_with(HOVERING, parameters={
    "values": {"DRK_KPP": 1.5, "NAV_DLL_ACT": 0, "EKF_AIDS": 17, "SIM_[red]": 2.0}, "total": 4,
    "types": {
        "DRK_KPP": mavlink.MAV_PARAM_TYPE_REAL32, "NAV_DLL_ACT": mavlink.MAV_PARAM_TYPE_INT32,
        "EKF_AIDS": mavlink.MAV_PARAM_TYPE_INT32, "SIM_[red]": mavlink.MAV_PARAM_TYPE_REAL32,
    },
    "metadata": {"DRK_KPP": GAIN, "NAV_DLL_ACT": ACTION, "EKF_AIDS": AIDS},
})  # fmt: skip


async def opened(pilot, app, row=""):
    """The screen is open and filled, the cursor on a row."""
    await pilot.press("p")
    await until(pilot, lambda: isinstance(app.screen, ParametersScreen) and "SIM_[red]" in screen_text(app))
    if row:
        app.screen.table.move_to(app.screen.table.keys.index(row))
        await until(pilot, lambda: f"{row}: " in screen_text(app))


async def shown(pilot, screen):
    """A dialog is open, and keys reach it."""
    await until(pilot, lambda: isinstance(pilot.app.screen, screen) and pilot.app.focused is not None)


def line_of(app, name):
    """The row of a parameter, as it is seen; empty while it is not."""
    return next((line for line in screen_text(app).splitlines() if f" {name} " in line), "")
