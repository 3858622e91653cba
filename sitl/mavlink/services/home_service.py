"""Home and origin in the state folder, and what follows when a peer moves them."""

from __future__ import annotations

import math
from dataclasses import astuple

from protocol.dialect import mavlink
from protocol.frames import LocalFrame, flip
from protocol.wire.message import Message
from sitl.autopilot.answers import Notice
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.orders import refuse_home, refuse_origin
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.commands import HOME_MESSAGES, take_home_message
from sitl.mavlink.handlers import on_message
from sitl.mavlink.services.plan_service import PlanService
from sitl.mavlink.telemetry.telemetry_service import TelemetryService
from sitl.tools.persistence import HomeAndOrigin, StateFolder

SAME_SITE = 100.0  # stored places are used if the vehicle starts no farther than this from where it started then [m]


class StoredHome:
    """Home and origin of the state folder, put in force if they fit; ``notices`` tells the pilot about it.

    Args:
        autopilot: Flies home.
        state_folder: Stores the places.

    Raises:
        SitlError: The file cannot be read.
    """

    def __init__(self, autopilot: Autopilot, state_folder: StateFolder) -> None:
        self._autopilot, self._state_folder = autopilot, state_folder
        self._start = autopilot.world.frame.origin
        self._stored: HomeAndOrigin | None = None
        self.notices: list[Notice] = []
        stored = state_folder.home_and_origin()
        if stored is not None:
            self._restore(stored)

    @property
    def where(self) -> str:
        """Position of home from the origin, in words."""
        north, west, up = self._autopilot.world.home
        north, east, up = (round(length, 1) + 0.0 for length in (north, -west, up))
        return f"{north} m north, {east} m east, {up} m up"

    def save(self) -> None:
        """Store where home and origin are now.

        Raises:
            StateFolderError: They cannot be written.
        """
        world = self._autopilot.world
        places = HomeAndOrigin(self._start, world.frame.origin, world.frame.to_geodetic(flip(world.home)))
        if places != self._stored:
            self._state_folder.save_home_and_origin(places)
            self._stored = places

    def _restore(self, stored: HomeAndOrigin) -> None:
        world = self._autopilot.world
        away = math.hypot(*world.frame.to_ned(stored.start))
        if away > SAME_SITE:
            self._warn(f"Stored home not used: it belongs to a start {away / 1e3:.1f} km from here")
            return
        if reason := refuse_origin(stored.origin):
            self._warn(f"Stored origin not used: {reason}")
            return
        frame = world.frame if stored.origin == stored.start else LocalFrame(stored.origin)
        home = flip(frame.to_ned(stored.home))
        if reason := refuse_home(home, world._replace(frame=frame)):
            self._warn(f"Stored home not used: {reason}")
            return
        self._autopilot.relocate(frame, home)
        self._stored = stored
        if frame is not world.frame:
            self._inform("Stored origin is {:.7f}, {:.7f}, {:.1f} m".format(*astuple(stored.origin)))
        self._inform(f"Stored home is {self.where}")

    def _inform(self, text: str) -> None:
        self.notices.append(Notice(mavlink.MAV_SEVERITY_INFO, text))

    def _warn(self, text: str) -> None:
        self.notices.append(Notice(mavlink.MAV_SEVERITY_WARNING, text))


class HomeService:
    """Saves and announces home and origin whenever a peer has moved them.

    Args:
        autopilot: Flies home.
        stored: Saves them.
        plans: Some may no longer be flown.
        telemetry: Makes messages of them.
        broadcast: Tells everyone.
    """

    def __init__(
        self,
        *,
        autopilot: Autopilot,
        stored: StoredHome,
        plans: PlanService,
        telemetry: TelemetryService,
        broadcast: Broadcast,
    ) -> None:
        self._autopilot, self._stored, self._plans = autopilot, stored, plans
        self._telemetry, self._broadcast = telemetry, broadcast

    def follow_move(self) -> None:
        """Home or origin has moved: save them, tell everyone, and check the plans that depend on them."""
        self._broadcast.save(self._stored.save)
        messages = self._telemetry.messages()
        self._broadcast.event(messages.message(mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN))
        self._broadcast.event(messages.message(mavlink.MAVLINK_MSG_ID_HOME_POSITION))
        self._broadcast.info(f"Home is {self._stored.where}")
        self._plans.recheck()

    def follow_mission(self) -> None:
        """The same after an item of a mission has moved home."""
        if self._autopilot.orders.home_moved:
            self._autopilot.orders.home_moved = False
            self.follow_move()

    @on_message(*HOME_MESSAGES)
    def take_message(self, message: Message) -> None:
        """A message that asks for another home or origin; it has no answer but a text."""
        answer = take_home_message(self._autopilot, message)
        if answer.accepted:
            self.follow_move()
        else:
            self._broadcast.complain(answer.text)
