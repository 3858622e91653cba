"""A gamepad that SDL makes itself: everything above the driver is what a real one goes through."""

from __future__ import annotations

import ctypes
import importlib
import os
import re
from pathlib import Path
from typing import Self

from darko_gcs.feed.gamepad import SDL_SETTINGS

AXES = ("left x", "left y", "right x", "right y", "left trigger", "right trigger")  # by SDL's numbers
BUTTONS = 15
JOYSTICKS = 0x200  # SDL_INIT_JOYSTICK: as long as this is here, whoever else lets it go
GAME_CONTROLLER = 1  # SDL_JOYSTICK_TYPE_GAMECONTROLLER
SDL = re.compile(r"/\S*libSDL2-\S*")


class VirtualGamepad:
    """The one gamepad that is connected, until it is unplugged or left."""

    def __init__(self) -> None:
        for name, value in SDL_SETTINGS.items():
            os.environ.setdefault(name, value)
        importlib.import_module("pygame")
        found = SDL.search(Path("/proc/self/maps").read_text())
        assert found is not None, "no SDL in this process"
        self._sdl = ctypes.CDLL(found[0])  # the library that pygame has loaded
        self._sdl.SDL_InitSubSystem(JOYSTICKS)
        self._sdl.SDL_JoystickOpen.restype = ctypes.c_void_p
        self._number = self._sdl.SDL_JoystickAttachVirtual(GAME_CONTROLLER, len(AXES), BUTTONS, 0)
        assert self._number >= 0, "SDL makes no gamepad"
        self._pad: ctypes.c_void_p | None = ctypes.c_void_p(self._sdl.SDL_JoystickOpen(self._number))
        self._sdl.SDL_JoystickUpdate()  # its first positions are what it stands at

    def move(self, axis: str, value: int) -> None:
        """Move an axis, -32768 (left, up) to 32767."""
        assert self._sdl.SDL_JoystickSetVirtualAxis(self._pad, AXES.index(axis), ctypes.c_int16(value)) == 0

    def unplug(self) -> None:
        """Take it away."""
        if self._pad is not None:
            self._sdl.SDL_JoystickDetachVirtual(self._number)
            self._pad = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.unplug()
        self._sdl.SDL_QuitSubSystem(JOYSTICKS)
