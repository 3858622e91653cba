"""Reasons to call the pilot: link lost, failsafe, crash, low battery, a doubtful filter, failures, others' commands."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import takewhile
from typing import NamedTuple

from darko_gcs.state.lasting_faults import can_last, without_ended
from darko_gcs.state.message_log import add_line
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import RESTARTED
from darko_gcs.state.values import Alert, LogLine, Simulator
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law

BATTERY_PARAMETERS = ("BAT_LOW_THR",)  # share left, as the vehicle has it
LOW_CHARGE = 0.2  # share left that is low, if the vehicle has no such parameter
MAX_TEST_RATIO = 1.0  # of the filter's readings: above, one is refused
FAILURE_SEVERITY = mavlink.MAV_SEVERITY_CRITICAL  # of a text that is a failure
CAUSE_SEVERITY = mavlink.MAV_SEVERITY_WARNING  # of a text that may say what a failsafe acts on
FAILURE_TEXTS = ("Failure injected:", "Flying without ")  # begin lesser ones that are, too
OWN_LINE = "Alert: "  # begins a line of this station about an alert
CRASH_TEXT = "crash"  # begins a text of the crash that the law tells, too
OTHERS_TEXT = re.compile(r"Ground station \d+ commanded: ")  # begins what the vehicle tells all but who commanded
CALM = 5.0  # without its reason, after which an alert may come again [s]
UNSAID = frozenset({"battery", "estimator", "failsafe"})  # kinds that have no line in the log yet
MAX_FAILURES = 50  # texts that call: a flood of invented ones must not start a program for each
MAX_ALERTS = 9  # that are kept: the oldest go first


class _Watch(NamedTuple):
    """A kind of alert."""

    kind: str
    reason: Callable[[Snapshot], str]  # words, if there is one
    lasting: float = 0.0  # for which the reason must last [s]


def _silent(s: Snapshot) -> str:
    expected = s.session.simulator is Simulator.STARTING  # anew, as the pilot wanted
    return "link lost: the vehicle is silent" if s.link.lost and not expected else ""


def _failsafe(s: Snapshot) -> str:
    state = s.hybrid.state
    if state is not None and state.law == Law.FAILSAFE:
        return "failsafe law: sinks upright until another law takes over"
    if not s.status.critical or s.hybrid.crashed:
        return ""
    since_boot = takewhile(lambda line: line.text.lower() != RESTARTED, reversed(s.log.lines))
    told = (line.text for line in since_boot if line.severity <= CAUSE_SEVERITY)
    cause = next((text for text in told if not text.startswith(OWN_LINE)), "")
    return "failsafe: the vehicle reports a critical state" + (f" ({cause})" if cause else "")


def _crash(s: Snapshot) -> str:
    return "crashed" if s.hybrid.crashed else ""


def low_charge(s: Snapshot) -> float:
    """Share of charge left below which the battery is low."""
    told = next((s.parameters.values[name] for name in BATTERY_PARAMETERS if name in s.parameters.values), math.nan)
    return told if 0.0 < told < 1.0 else LOW_CHARGE


def _battery(s: Snapshot) -> str:
    left = s.battery.charge_left
    return f"battery low: {100.0 * left:.0f} % left" if left is not None and left <= low_charge(s) else ""


def _estimator(s: Snapshot) -> str:
    ratio = s.estimates.test_ratio
    if ratio is None or ratio <= MAX_TEST_RATIO or s.hybrid.crashed:
        return ""
    return f"estimator: refuses the {s.estimates.worst_reading or 'reading'} (test ratio {ratio:.1f}, at most 1)"


WATCHES = (
    _Watch("crash", _crash),
    _Watch("link", _silent),
    _Watch("failsafe", _failsafe, 0.5),  # a crash is told by the heartbeat first
    _Watch("battery", _battery, 1.0),
    _Watch("estimator", _estimator, 2.0),
)


class AlertWatch:
    """Notices each reason once: again only after it was gone for some seconds, and each text of a failure once."""

    def __init__(self) -> None:
        self._begun: dict[str, float] = {}  # since when each reason is there [s]
        self._last_seen: dict[str, float] = {}  # when each reason was last there [s]
        self._raised: set[str] = set()
        self._line: LogLine | None = None  # the last one that was looked at
        self._failures: set[str] = set()  # texts

    def look(self, s: Snapshot, now: float) -> Snapshot:
        """The snapshot with what calls the pilot at a time [s]."""
        if s.identity.source is None:
            return s
        alerts = s.session.alerts
        for kind, text in [*self._reasons(s, now), *self._failed(s)]:
            alerts = (*alerts, Alert(kind, text, now))[-MAX_ALERTS:]
            if kind in UNSAID:
                s = add_line(s, now, mavlink.MAV_SEVERITY_ALERT, f"{OWN_LINE}{text}")
        alerts = self._with_ended(alerts, self._news(s), now)
        for alert in [alert for alert in alerts if self._is_over(alert, now)]:
            last = self._last_seen[alert.kind]
            alerts = tuple(a._replace(over=last) if a is alert else a for a in alerts)
            over = f"Over: {alert.text} ({max(0.0, last - alert.time):.0f} s)"
            s = add_line(s, now, mavlink.MAV_SEVERITY_NOTICE, over)
        seen = self._lasting(s, now)
        self._line = s.log.lines[-1] if s.log.lines else None
        if alerts is s.session.alerts and seen == s.session.seen:
            return s
        return s._replace(session=s.session._replace(alerts=alerts, seen=seen))

    def _with_ended(self, alerts: tuple[Alert, ...], news: Sequence[LogLine], now: float) -> tuple[Alert, ...]:
        """The alerts, with those over whose end is told: the pilot may not have seen them yet.

        The same failure calls again once it has ended.
        """
        ended = [a for a in alerts if can_last(a) and not without_ended((a,), behind(news, a.text))]
        self._failures -= {alert.text for alert in ended}
        return tuple(alert._replace(over=now) if alert in ended else alert for alert in alerts)

    def _lasting(self, s: Snapshot, now: float) -> tuple[Alert, ...]:
        """The seen alerts whose reason lasts; a failure that has ended calls again."""
        lasting = tuple(a for a in s.session.seen if without_ended((a,), behind(self._news(s), a.text)))
        self._failures -= {alert.text for alert in s.session.seen if alert not in lasting}
        return tuple(alert for alert in lasting if not self._is_over(alert, now))

    def _news(self, s: Snapshot) -> tuple[LogLine, ...]:
        """Lines of the log since the last look."""
        lines = s.log.lines
        if lines and lines[-1] is self._line:
            return ()
        return tuple(lines[next((k + 1 for k in range(len(lines) - 1, -1, -1) if lines[k] is self._line), 0) :])

    def _is_over(self, alert: Alert, now: float) -> bool:
        """Whether an alert has just become past: its reason was gone for some seconds."""
        is_watched = alert.kind in self._last_seen and alert.over is None
        return is_watched and now - self._last_seen[alert.kind] >= CALM

    def _reasons(self, s: Snapshot, now: float) -> Iterator[tuple[str, str]]:
        for watch in WATCHES:
            text = watch.reason(s)
            if text:
                self._last_seen[watch.kind] = now
                begun = self._begun.setdefault(watch.kind, now)
                if now - begun >= watch.lasting and watch.kind not in self._raised:
                    self._raised.add(watch.kind)
                    yield watch.kind, text
                continue
            self._begun.pop(watch.kind, None)
            if now - self._last_seen.get(watch.kind, -math.inf) >= CALM:
                self._raised.discard(watch.kind)

    def _failed(self, s: Snapshot) -> Iterator[tuple[str, str]]:
        """Texts of failures since the last look."""
        news = self._news(s)
        for text in self._commanded(s, news):
            yield "command", text
        for line in news:
            is_new = line.text not in self._failures and len(self._failures) < MAX_FAILURES
            is_failure = line.severity <= FAILURE_SEVERITY or line.text.startswith(FAILURE_TEXTS)
            if not (is_failure and is_new):
                continue
            self._failures.add(line.text)
            if not line.text.lower().startswith(CRASH_TEXT):
                yield "failure", line.text
            elif "crash" not in self._raised:
                self._raised.add("crash")
                self._last_seen["crash"] = s.log.lines[-1].time
                yield "crash", line.text

    def _commanded(self, s: Snapshot, lines: Iterable[LogLine]) -> Iterator[str]:
        """Commands of others; the same one calls again once the pilot has seen it."""
        shown = {alert.text for alert in s.session.alerts}
        for text in dict.fromkeys(line.text for line in lines if OTHERS_TEXT.match(line.text)):
            if text not in shown and (text in self._failures or len(self._failures) < MAX_FAILURES):
                self._failures.add(text)
                yield text


def behind(lines: Sequence[LogLine], text: str) -> Sequence[LogLine]:
    """Lines behind the last one with a text; all of them without one."""
    return lines[max((k + 1 for k, line in enumerate(lines) if line.text == text), default=0) :]


def acknowledged(s: Snapshot) -> Snapshot:
    """The snapshot after the pilot has seen its alerts; those of what lasts are kept apart."""
    lasting = [alert for alert in s.session.alerts if can_last(alert)]
    texts = {alert.text for alert in lasting}
    seen = (*(alert for alert in s.session.seen if alert.text not in texts), *lasting)[-MAX_ALERTS:]
    return s._replace(session=s.session._replace(alerts=(), seen=seen))
