"""A vehicle that holds what it was sent, or something else, without a link."""

from protocol.events import MissionDownloaded, MissionUploaded
from tests.support.gcs.snapshots import HOVERING


class PlanHolder:
    """In place of a link and its station: answers uploads at once.

    Args:
        change: What it makes of the items that it is sent; they are as they were without.
    """

    def __init__(self, change=lambda items: items):
        self.station = self.plans = self
        self.snapshot, self._now = HOVERING, 0.0
        self._change, self._events = change, []

    @property
    def now(self):
        """A clock that goes on by a second whenever it is looked at."""
        self._now += 1.0
        return self._now

    def arm(self, now):
        pass  # nor does it answer

    def start_mission(self, now):
        pass  # likewise

    def upload(self, items, _now, *, fence=(), rally=(), verify=False):
        sent = {0: items} | {kind: part for kind, part in ((1, fence), (2, rally)) if part}
        self._events += [MissionUploaded(len(part), kind) for kind, part in sent.items()]
        if verify:
            self._events += [MissionDownloaded(self._change(part), kind) for kind, part in sent.items()]

    def events(self):
        events, self._events = self._events, []
        return events
