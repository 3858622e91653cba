"""Requests about missions: load, start, jump to an item."""

from __future__ import annotations

import math
from collections.abc import Sequence

from protocol.dialect import mavlink
from protocol.names import Mode
from protocol.plans.plan import MissionItem
from sitl.autopilot.answers import ACCEPTED, DENIED, FAILED, REJECTED, Answer
from sitl.autopilot.arming import Arming
from sitl.autopilot.flight_state import FlightState
from sitl.autopilot.mission.runner import MissionRunner
from sitl.control.reference import upright
from sitl.guidance.manoeuvres import Hold


class MissionRequests:
    """Loads, starts and flies the mission of a flight."""

    def __init__(self, flight: FlightState, arming: Arming) -> None:
        self._flight, self._arming = flight, arming
        self._reached: list[int] = []

    def take_reached(self) -> list[int]:
        """Mission items done since the last call."""
        taken, self._reached = self._reached, []
        return taken

    def load(self, items: Sequence[MissionItem]) -> None:
        """Replace the mission by one that is valid; if the old one is being flown, the vehicle holds."""
        flight = self._flight
        if flight.mode is Mode.MISSION:
            flight.hold_here()
        flight.mission = flight.runner_of(tuple(items)) if items else None

    def revise(self, items: Sequence[MissionItem]) -> None:
        """Put other items in the place of the mission's own; it goes on, to where the current item is now.

        Where fence or home forbid the new items, a vehicle that flies the mission holds.
        """
        flight, mission = self._flight, self._flight.mission
        if mission is None or len(items) != len(mission.items):
            self.load(items)
            return
        mission.revise(tuple(items))
        if flight.mode is Mode.MISSION and (outside := flight.refuse_mission()):
            flight.say(mavlink.MAV_SEVERITY_WARNING, f"Mission left: {outside}")
            flight.hold_here()

    def choose(self) -> Answer:
        """Choose the mission mode before arming; arming then starts the mission."""
        flight = self._flight
        if flight.mission is None:
            return flight.refuse(REJECTED, "Mission refused: none is loaded")
        if outside := flight.refuse_mission():
            return flight.refuse(DENIED, f"Mission denied: {outside}")
        return self._arming.wait_for_arming(Mode.MISSION, self.start, flight.refuse_mission)

    def start(self, first: int | None = None) -> Answer:
        """Fly the mission from an item, or from the current one (from the start if it was complete).

        Disarmed, it is checked, and waits for arming.
        """
        flight, mission = self._flight, self._flight.mission
        if mission is None:
            return flight.refuse(REJECTED, "Mission refused: none is loaded")
        if outside := flight.refuse_mission():
            return flight.refuse(DENIED, f"Mission denied: {outside}")
        if first is not None and not 0 <= first < len(mission.items):
            return flight.refuse(DENIED, f"Mission denied: no item {first} (it has {len(mission.items)})")
        if not flight.armed:
            return self._arming.wait_for_arming(Mode.MISSION, lambda: self.start(first), flight.refuse_mission)
        flight.enter(Mode.MISSION, None)
        if first == 0 or mission.finished or (first is None and self._starts_anew(mission)):
            mission.restart(first or 0)
            flight.camera.begin_mission()
            flight.roi = None
        elif first is not None:
            mission.jump_to(first)
        mission.interrupt()
        flight.camera.resume_mission()
        flight.flying = True
        return Answer(ACCEPTED)

    def restart(self) -> Answer:
        """Fly the mission from its first item if it was broken off, else from the current one."""
        mission = self._flight.mission
        return self.start(0 if mission is not None and mission.begun else None)

    def _starts_anew(self, mission: MissionRunner) -> bool:
        """Whether flying on is a start from the first item: not that item resumed in flight, nor one in between.

        On the ground nothing is left of a mission that was broken off at its last item.
        """
        if mission.begun and not self._flight.flying:
            return mission.current in {0, len(mission.items) - 1}
        return mission.current == 0 and not mission.begun

    def set_current(self, seq: int | None, *, resets: bool = False) -> Answer:
        """Make an item the current one, flying or not.

        Args:
            seq: The item; None: the one that is current.
            resets: Whether counters of jumps, speeds and ways of flying begin anew, and a mission that was complete
                can go on.
        """
        mission = self._flight.mission
        if mission is None or (seq is not None and not 0 <= seq < len(mission.items)):
            count = len(mission.items) if mission else 0
            named = "" if seq is None else f" {seq}"
            return self._flight.refuse(FAILED, f"No mission item{named} (it has {count})")
        if seq is not None:
            mission.jump_to(seq)
        if resets:
            mission.reset()
        return Answer(ACCEPTED)

    def update(self, mission: MissionRunner) -> None:
        """Fly the mission for one tick."""
        flight = self._flight
        flight.reference = mission.update(flight.view)
        self._collect(mission)
        if mission.paused or mission.finished:
            flight.flying &= not flight.view.landed  # what ends on the ground stays there
        if mission.paused:
            self._pause()
        elif mission.finished:
            flight.say(mavlink.MAV_SEVERITY_NOTICE, "Mission complete: holding")
            self._end()

    def _pause(self) -> None:
        """Hold where the item ended; in forward flight, where the vehicle can stop."""
        flight = self._flight
        if flight.view.forward:
            flight.hold_here()
        else:
            flight.enter(Mode.HOLD, Hold(upright(flight.reference)))

    def _end(self) -> None:
        """Hold at the last waypoint if the vehicle is there, else where it can stop; on the ground, stand."""
        flight = self._flight
        is_there = math.dist(flight.view.p, flight.reference.position) <= flight.settings.acceptance
        if flight.flying and is_there:
            self._pause()
        else:
            flight.hold_here()

    def touched_down(self) -> None:
        """The vehicle touched the ground."""
        mission = self._flight.mission
        if self._flight.mode is Mode.MISSION and mission is not None:
            mission.touched_down()
            self._collect(mission)

    def _collect(self, mission: MissionRunner) -> None:
        self._reached += mission.reached
        for text in mission.notices:
            self._flight.say(mavlink.MAV_SEVERITY_NOTICE, text)
        mission.reached.clear()
        mission.notices.clear()
