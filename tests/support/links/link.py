"""A ground station and a vehicle on one link, on a virtual clock: time jumps from deadline to deadline."""

import math
from collections.abc import Callable

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.engines.table_values import Parameter
from protocol.events import (
    CommandRequested,
    CurrentItemRequested,
    Event,
    MessageRequested,
    MissionCleared,
    MissionReceived,
)
from protocol.plans.plan import MissionItem
from protocol.wire.codec import Codec
from protocol.wire.message import Message
from tests.support.links.lossy_pipe import LossyPipe
from tests.support.links.virtual_clock import VirtualClock

ARM, TAKEOFF, START = (
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM,
    mavlink.MAV_CMD_NAV_TAKEOFF,
    mavlink.MAV_CMD_MISSION_START,
)
ITEM_TIME = 0.4  # [s] the vehicle needs from one item to the next


def plan(count: int, offset: int = 0) -> tuple[MissionItem, ...]:
    params = (0.0, 1.5, math.nan, -0.0)
    return tuple(MissionItem(command=16, frame=3, params=params, x=offset + n, y=-n, z=10.0 + n) for n in range(count))


def table(count: int = 12) -> list[Parameter]:
    real, integer = mavlink.MAV_PARAM_TYPE_REAL32, mavlink.MAV_PARAM_TYPE_INT32
    floats = [Parameter(name=f"K_{n}", type=real, value=n / 4, minimum=-100.0, maximum=100.0) for n in range(count - 1)]
    return [*floats, Parameter(name="N_MAX", type=integer, value=-7, minimum=-10, maximum=10)]


class FakeVehicle:
    """A minimal autopilot: it executes commands and reaches one mission item after the other."""

    def __init__(self, items: tuple[MissionItem, ...] = ()) -> None:
        self.endpoint = VehicleEndpoint(
            commands={ARM, TAKEOFF, START},
            parameters=table(),
            mission=items,
            validate=lambda _items: None,
            streams={mavlink.MAVLINK_MSG_ID_ATTITUDE: 20_000},
            peers=["ground"],
        )
        self.plan = items
        self.executed: list[int] = []
        self.armed = self.flying = False
        self.seq, self.next_item = 0, math.inf
        self.log: list[Event] = []

    def step(self, now: float) -> None:
        if now >= self.next_item:
            self.endpoint.publish(mavlink.MAVLink_mission_item_reached_message(self.seq))
            last = self.seq + 1 == len(self.plan)
            self._publish_current(self.seq if last else self.seq + 1)
            self.next_item = math.inf if last else now + ITEM_TIME
        mode = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0)
        self.endpoint.announce(mavlink.MAVLink_heartbeat_message(19, 12, mode, 0, 4, 3), now)
        self.endpoint.handle_timer(now)

    def execute_requests(self, now: float) -> None:
        for event in self.endpoint.events():
            self.log.append(event)
            if isinstance(event, CommandRequested):
                self.executed.append(event.command)
                self.endpoint.acknowledge(event.request, self._execute(event, now), now)
            elif isinstance(event, MissionReceived):
                self.plan = event.items
            elif isinstance(event, MissionCleared):
                self.plan = ()
            elif isinstance(event, CurrentItemRequested):
                self._publish_current(event.seq)
            elif isinstance(event, MessageRequested):
                self.endpoint.send(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0), event.peer)

    def _execute(self, event: CommandRequested, now: float) -> int:
        if event.command == ARM:
            self.armed = event.params[0] == 1
        elif not self.armed:
            return int(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        elif event.command == TAKEOFF:
            self.flying = True
        else:
            self.next_item = now + ITEM_TIME
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def _publish_current(self, seq: int) -> None:
        self.seq = seq
        self.endpoint.publish(mavlink.MAVLink_mission_current_message(seq, len(self.plan)))


class Link:
    """Both ends and the two pipes between them."""

    def __init__(
        self,
        seed: int = 0,
        *,
        items: tuple[MissionItem, ...] = (),
        to_vehicle: dict[str, float] | None = None,
        **losses: float,
    ) -> None:
        self.clock = VirtualClock()
        self.ground, self.vehicle = GroundEndpoint(), FakeVehicle(items)
        self.up = LossyPipe(seed, **(losses if to_vehicle is None else to_vehicle))
        self.down = LossyPipe(seed + 1, **losses)
        self.events: list[Event] = []
        self.messages: list[Message] = []

    @property
    def now(self) -> float:
        return self.clock.now

    def run(self, until: Callable[[], bool] = lambda: False, *, limit: float = 60.0) -> bool:
        """Run until the condition holds; False if it does not within ``limit`` seconds of virtual time."""
        end = self.now + limit
        while True:
            self._settle()
            if until():
                return True
            ends = (self.ground, self.vehicle.endpoint, self.vehicle)
            deadlines = [getattr(e, "next_deadline", lambda: self.vehicle.next_item)() for e in ends]
            instant = max(min(*deadlines, self.up.next_arrival(), self.down.next_arrival()), self.now)
            if instant > end:
                self.clock.advance_to(end)
                return False
            self.clock.advance_to(instant)

    def wait_for(self, *kinds: type[Event], limit: float = 60.0) -> Event:
        """Run until one of these events arrives on the ground, and return it."""
        start = len(self.events)
        assert self.run(lambda: any(isinstance(e, kinds) for e in self.events[start:]), limit=limit), kinds
        return next(e for e in self.events[start:] if isinstance(e, kinds))

    def _settle(self) -> None:
        now = self.now
        for data in self.up.receive(now):
            self.vehicle.endpoint.receive_datagram(data, "ground", now)
            self.vehicle.execute_requests(now)
        for data in self.down.receive(now):
            self.messages += self.ground.receive_datagram(data, now)
        self.vehicle.step(now)
        self.ground.handle_timer(now)
        for _, data in self.vehicle.endpoint.datagrams_to_send():
            self.down.send(data, now)
        for data in self.ground.datagrams_to_send():
            self.up.send(data, now)
        self.events += self.ground.events()


def frame(message, system: int = 255, component: int = 190) -> bytes:
    """A message as that system would send it."""
    return Codec(system, component).encode(message)
