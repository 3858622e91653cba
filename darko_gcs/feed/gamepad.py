"""A gamepad by SDL (pygame-ce, extra ``joystick``), which knows the axes of some hundred makes."""

from __future__ import annotations

import importlib
import os
from typing import Any, Protocol

from darko_gcs.errors import GroundError
from darko_gcs.state.sticks import Sticks

FULL_AXIS = 32768.0  # value at the end of an axis
DEAD_ZONE = 0.08  # of an axis about its centre
SDL_SETTINGS = {
    "PYGAME_HIDE_SUPPORT_PROMPT": "1",
    "SDL_VIDEODRIVER": "dummy",  # its events need a window system: one that shows nothing
    "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS": "1",
    "SDL_NO_SIGNAL_HANDLERS": "1",  # Ctrl+C stays ours
}


class StickDevice(Protocol):
    """Something with sticks."""

    name: str

    def read(self) -> Sticks | None:
        """The sticks now; None if it is gone."""

    def close(self) -> None:
        """Let it go."""


class Gamepad:
    """The first gamepad that is connected: left stick climbs and turns, right stick goes forward and sideways.

    Raises:
        GroundError: pygame is missing, or no gamepad is connected.
    """

    def __init__(self) -> None:
        for name, value in SDL_SETTINGS.items():
            os.environ.setdefault(name, value)
        try:
            self._sdl: Any = importlib.import_module("pygame")
            self._driver: Any = importlib.import_module("pygame._sdl2.controller")
        except ImportError as error:
            raise GroundError("a gamepad needs pygame-ce: pip install 'darko[joystick]'") from error
        self._sdl.display.init()
        self._driver.init()
        self._pad: Any = None
        known = [number for number in range(self._driver.get_count()) if self._driver.is_controller(number)]
        if not known:
            self.close()
            raise GroundError("no gamepad is connected, or none that SDL knows")
        self._pad = self._driver.Controller(known[0])
        self.name = str(self._pad.name)

    def read(self) -> Sticks | None:
        """The sticks now; None if it is unplugged."""
        self._sdl.event.pump()
        if not self._pad.attached():
            return None
        return Sticks(
            forward=-self._axis("RIGHTY"),
            right=self._axis("RIGHTX"),
            up=-self._axis("LEFTY"),
            clockwise=self._axis("LEFTX"),
        )

    def close(self) -> None:
        """Let it go. After two ``pygame.quit()`` no gamepad of this process would move any more."""
        if self._pad is not None:
            self._pad.quit()
        self._driver.quit()
        self._sdl.display.quit()

    def _axis(self, name: str) -> float:
        """An axis, -1..1 right and down, zero about its centre."""
        value = float(self._pad.get_axis(getattr(self._sdl, f"CONTROLLER_AXIS_{name}"))) / FULL_AXIS
        beyond = max(0.0, abs(value) - DEAD_ZONE) / (1.0 - DEAD_ZONE)
        return min(1.0, beyond) if value > 0.0 else -min(1.0, beyond)
