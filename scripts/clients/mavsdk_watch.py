"""The vehicle's telemetry as ``mavsdk_session.py`` waits for it."""

from __future__ import annotations

import threading
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from typing import Any

FLIGHT_TIMEOUT = 90.0  # for anything that is flown [s]
TOPICS = (
    "altitude", "armed", "attitude_euler", "flight_mode", "ground_truth", "health_all_ok", "home", "imu", "in_air",
    "landed_state", "odometry", "position", "position_velocity_ned", "raw_imu", "scaled_imu", "status_text",
    "vtol_state",
)  # fmt: skip


class SessionError(Exception):
    """The vehicle did not do what was asked."""


class Watch:
    """The newest value of each telemetry topic, and the last hundred different ones."""

    def __init__(self, telemetry: Any) -> None:  # noqa: ANN401 - MAVSDK is untyped
        self.newest: dict[str, Any] = {}
        self.history: dict[str, list[Any]] = defaultdict(list)
        self._news = threading.Condition()
        for topic in TOPICS:
            getattr(telemetry, f"subscribe_{topic}")(partial(self._take, topic))

    def hear(self, topic: str, value: Any) -> None:  # noqa: ANN401
        """Record a value; also called for plugins other than telemetry."""
        with self._news:
            self.newest[topic] = value
            if topic == "status_text":
                self.history[topic].append(value.text)
            elif not self.history[topic] or self.history[topic][-1] != value:
                self.history[topic] = [*self.history[topic][-99:], value]
            self._news.notify_all()

    def until(self, what: str, holds: Callable[[dict[str, Any]], bool], timeout: float = FLIGHT_TIMEOUT) -> None:
        """Wait until a condition on the telemetry holds.

        Raises:
            SessionError: If it does not in time.
        """
        with self._news:
            if not self._news.wait_for(lambda: self._check(holds), timeout):
                texts = "; ".join(self.history["status_text"][-5:])
                raise SessionError(f"not {what} within {timeout:g} s; the vehicle's last texts: {texts}")

    def until_is(self, topic: str, value: Any) -> None:  # noqa: ANN401
        """Wait for a topic to have a value."""
        self.until(f"{topic} {getattr(value, 'name', value)}", lambda now: now.get(topic) == value)

    def _take(self, topic: str, value: Any, _data: Any) -> None:  # noqa: ANN401
        self.hear(topic, value)

    def _check(self, holds: Callable[[dict[str, Any]], bool]) -> bool:
        try:
            return holds(self.newest)
        except KeyError:  # not received yet
            return False
