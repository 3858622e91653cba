"""Injected failures over the link (MAV_CMD_INJECT_FAILURE), and the link's own.

https://mavlink.io/en/messages/common.html#MAV_CMD_INJECT_FAILURE. A link that is off can hear no command that heals it:
it comes back by itself after SIM_LINK_OFF_T.
"""

from __future__ import annotations

from protocol.dialect import mavlink
from protocol.events import CommandRequested
from sitl.autopilot.answers import DENIED, Answer
from sitl.mavlink.handlers import on_command
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.injected_failures import ALL, FAILURE_TYPES, FLICKER_TIME

_HEALTHY, _INTERMITTENT = mavlink.FAILURE_TYPE_OK, mavlink.FAILURE_TYPE_INTERMITTENT


class FailureService:
    """Carries the command out, and says whether the link works.

    Args:
        aircraft: What fails.
    """

    def __init__(self, aircraft: Aircraft) -> None:
        self._aircraft = aircraft
        self._failed_at: float | None = None  # when the link began to fail, on the link's time [s]

    @on_command(mavlink.MAV_CMD_INJECT_FAILURE)
    def inject(self, request: CommandRequested) -> Answer:
        """param1 FAILURE_UNIT, param2 FAILURE_TYPE, param3 instance; 0 or NaN: all."""
        if not self._aircraft.configuration.settings.failure_injection:
            return Answer(DENIED, "Failure denied: set SYS_FAILURE_EN to 1 first")
        unit, failure, instance = map(int, (request.params[0], request.params[1], request.param(3, ALL)))
        if failure not in FAILURE_TYPES:
            return Answer(DENIED, f"Failure denied: {failure} is not a FAILURE_TYPE")
        answer = self._aircraft.failures.inject(unit, failure, instance)
        if answer.accepted:
            self._aircraft.autopilot.say(mavlink.MAV_SEVERITY_WARNING, answer.text)
        return answer

    def carries(self, now: float) -> bool:
        """Whether datagrams come and go.

        Args:
            now: The link's time [s].
        """
        failure = self._aircraft.failures.link
        if failure == _HEALTHY or self._failed_at is None:
            return True
        elapsed = now - self._failed_at
        if failure == _INTERMITTENT:
            return int(elapsed / FLICKER_TIME) % 2 == 1
        if elapsed >= self._aircraft.configuration.world.link_off_time:
            self._aircraft.failures.link, self._failed_at = _HEALTHY, None
            self._aircraft.autopilot.say(mavlink.MAV_SEVERITY_INFO, "Link is back")
            return True
        return False

    def sent(self, now: float) -> None:
        """Everything was sent up to a link's time [s], the answer to the command as well: a failure begins."""
        is_failing = self._aircraft.failures.link != _HEALTHY
        self._failed_at = (now if self._failed_at is None else self._failed_at) if is_failing else None
