"""Tables of streams: what is sent, how often, by which vehicle. Each module of messages has one."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

from protocol.wire.message import Message
from sitl.mavlink.telemetry.vehicle_snapshot import VehicleSnapshot
from sitl.simulation.avionics import Navigation

Build = Callable[[VehicleSnapshot], Message | list[Message]]
BuildT = TypeVar("BuildT", bound=Build)
ALWAYS = frozenset(Navigation)
SENSED, OUTDOORS = ALWAYS - {Navigation.TRUTH}, frozenset({Navigation.SENSORS})


class Stream(NamedTuple):
    """A message of the telemetry."""

    message_id: int
    build: Build
    rate: float  # of simulated time, unless a peer asks for another [Hz]; 0: on request only
    needs: frozenset[Navigation] = ALWAYS  # only a vehicle that navigates by one of these has it


class StreamTable:
    """The streams that a module of messages builds."""

    def __init__(self) -> None:
        self.rows: list[Stream] = []

    def sends(
        self, message_id: int, rate: float, needs: frozenset[Navigation] = ALWAYS, *, once_aligned: bool = False
    ) -> Callable[[BuildT], BuildT]:
        """Decorate the function that builds a stream's message or messages.

        Args:
            message_id: Of the message.
            rate: Of simulated time, unless a peer asks for another [Hz]; 0: on request only.
            needs: Only a vehicle that navigates by one of these has it.
            once_aligned: None is sent before attitude and place are known.
        """

        def add(build: BuildT) -> BuildT:
            self.rows.append(Stream(message_id, _once_aligned(build) if once_aligned else build, rate, needs))
            return build

        return add


def _once_aligned(build: Build) -> Build:
    def built(s: VehicleSnapshot) -> Message | list[Message]:
        return build(s) if s.navigation.is_aligned else []

    return built
