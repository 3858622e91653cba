"""Changes parameters, a few at a time, and judges each change only once the vehicle has stayed with its answer.

A vehicle may echo a value and refuse it then; and it may refuse a value that fits once others of the same file are
set. So what is refused is tried once more after the others.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Mapping

from darko_gcs.state.message_log import add_line
from darko_gcs.state.parameter_change import ChangeState, ParameterChange
from darko_gcs.state.parameter_metadata import number_text, same_value
from darko_gcs.state.reduce_events import reduce_event
from darko_gcs.state.snapshot import Snapshot, updated
from darko_gcs.state.text import reason_text
from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.errors import LocalProtocolError
from protocol.events import Event, ParameterConfirmed, ParameterFailed

REFUSAL_TIME = 0.5  # after an answer, in which a value may still be refused, and the vehicle says why [s]
MAX_OPEN_CHANGES = 10  # that wait for an answer at a time

Answer = ParameterConfirmed | ParameterFailed


class ParameterChanges:
    """The changes of one operator; where each stands is in the snapshot's ``parameter_changes``.

    Args:
        endpoint: Sends them; hand in its events.
    """

    def __init__(self, endpoint: GroundEndpoint) -> None:
        self._endpoint = endpoint
        self._queue: deque[tuple[str, float]] = deque()
        self._open: set[str] = set()
        self._answers: dict[str, tuple[Answer, float]] = {}  # not judged yet, and since when [s]
        self._refused: dict[str, float] = {}  # the first time: tried again after the others
        self._repeated: set[str] = set()
        self._has_set = False  # one since all were done

    def request(self, s: Snapshot, wanted: Mapping[str, float], now: float) -> Snapshot:
        """Begin to set parameters. Returns the snapshot with these changes waiting."""
        for name, value in wanted.items():
            self._forget(name)
            self._queue.append((name, value))
        waiting = {name: ParameterChange(value) for name, value in wanted.items()}
        return self._send(updated(s, parameter_changes={**s.parameter_changes, **waiting}), now)

    def take(self, event: Event, now: float) -> bool:
        """Take an event of the endpoint. Returns True if it is an answer, which ``handle_timer`` reports."""
        if not isinstance(event, ParameterConfirmed | ParameterFailed) or event.name not in self._open:
            return False
        self._open.discard(event.name)
        self._answers[event.name] = (event, now)
        return True

    def handle_timer(self, s: Snapshot, now: float) -> Snapshot:
        """Judge the answers that are old enough and send what is next."""
        for name, (answer, since) in tuple(self._answers.items()):
            if now - since >= REFUSAL_TIME:
                del self._answers[name]
                s = self._judge(s, answer, since, now)
        if self._refused and not (self._queue or self._open or self._answers):
            self._queue.extend(self._refused.items())
            self._repeated, self._refused = set(self._refused), {}
        return self._send(s, now)

    def _judge(self, s: Snapshot, answer: Answer, since: float, now: float) -> Snapshot:
        name, change = answer.name, s.parameter_changes[answer.name]
        if isinstance(answer, ParameterConfirmed):
            kept = s.parameters.get(name, answer.value)
            if same_value(kept, answer.value):
                self._has_set = True
                return reduce_event(_with_change(s, name, ParameterChange(change.value, ChangeState.SET)), answer, now)
            line = f"Parameter {name} stays {number_text(kept)}: the vehicle refused {number_text(answer.value)}"
        else:
            line = f"Parameter {name}: {reason_text(answer.reason)}"
        reason = _words_about(s, name, since) or change.reason
        if self._may_repeat(name):
            self._refused[name] = change.value
            return _with_change(s, name, change._replace(reason=reason))  # vehicles say the same only once in a while
        reason = reason or line.partition(": ")[2]
        s = _with_change(s, name, change._replace(state=ChangeState.REFUSED, reason=reason))
        return add_line(s, now, mavlink.MAV_SEVERITY_WARNING, line)

    def _may_repeat(self, name: str) -> bool:
        return name not in self._repeated and bool(self._has_set or self._queue or self._open or self._answers)

    def _send(self, s: Snapshot, now: float) -> Snapshot:
        while self._queue and len(self._open) < MAX_OPEN_CHANGES:
            name, value = self._queue.popleft()
            try:
                self._endpoint.set_parameter(name, value, now)
            except LocalProtocolError as error:
                refused = ParameterChange(value, ChangeState.REFUSED, str(error))
                s = add_line(_with_change(s, name, refused), now, mavlink.MAV_SEVERITY_WARNING, str(error))
            else:
                self._open.add(name)
        if not (self._queue or self._open or self._answers or self._refused):
            self._has_set, self._repeated = False, set()
        return s

    def _forget(self, name: str) -> None:
        """An earlier change of the parameter is replaced."""
        self._queue = deque(pair for pair in self._queue if pair[0] != name)
        self._open.discard(name)
        self._answers.pop(name, None)
        self._refused.pop(name, None)
        self._repeated.discard(name)


def _with_change(s: Snapshot, name: str, change: ParameterChange) -> Snapshot:
    return updated(s, parameter_changes={**s.parameter_changes, name: change})


def _words_about(s: Snapshot, name: str, since: float) -> str:
    """Text of the vehicle about a parameter since about a time; empty if there is none."""
    recent = (line.text for line in reversed(s.messages) if line.time >= since - REFUSAL_TIME)
    return next(
        (text for text in recent if name in re.findall(r"\w+", text) and not text.startswith(f"Parameter {name}")), ""
    )
