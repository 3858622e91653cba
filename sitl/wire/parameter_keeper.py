"""Parameters as peers change them: bound to the vehicle, kept, and told in words where that fails."""

from __future__ import annotations

from collections.abc import Callable

from protocol.dialect import mavlink
from protocol.events import ParameterChanged, ParameterRefused
from sitl.autopilot.settings import Settings
from sitl.craft import Craft
from sitl.errors import SitlError
from sitl.memory import Keep, Memory
from sitl.parameters import Bindings, Surroundings
from sitl.simulation.tuning import Tuning

WARNING = mavlink.MAV_SEVERITY_WARNING


class ParameterKeeper:
    """The parameters that differ from what the vehicle is built with.

    Args:
        craft: Flies by them.
        memory: Keeps them.
        show: Tells everyone a parameter's value.
        say: Tells everyone a line, with its MAV_SEVERITY.
        keep: Calls what writes, and says what could not be written.
    """

    def __init__(
        self,
        craft: Craft,
        memory: Memory,
        show: Callable[[str, float], None],
        say: Callable[[int, str], None],
        keep: Keep,
    ) -> None:
        self._craft, self._memory, self._show, self._say, self._keep = craft, memory, show, say, keep
        self._kept = memory.parameters()

    def changed(self, event: ParameterChanged) -> None:
        """A peer set a parameter to a value it can have; what does not go with the others is set back."""
        before = self._craft.bindings
        try:
            self._craft.bind(before.replaced({event.name: event.value}))
        except SitlError as error:
            self._show(event.name, before.value(event.name))
            self._say(WARNING, str(error))
            return
        self._kept[event.name] = event.value
        self._write()

    def refused(self, event: ParameterRefused) -> None:
        """A peer wanted what cannot be."""
        what = event.name if event.value is None else f"{event.name} = {event.value:g}"
        self._say(WARNING, f"{what} refused: {event.reason}")

    def reset(self) -> None:
        """Return all of them to their defaults."""
        before = self._craft.bindings
        self._craft.bind(Bindings(Settings(), Tuning(), Surroundings()))
        for parameter in self._craft.bindings.wire_table():
            if before.value(parameter.name) != parameter.value:
                self._show(parameter.name, parameter.value)
        self._kept.clear()
        self._write()

    def _write(self) -> None:
        self._keep(lambda: self._memory.keep_parameters(self._kept))
