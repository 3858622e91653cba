"""A feed that stands still, and how to wait for a screen."""

import inspect
from typing import Any

from darko_gcs.state.field_history import FieldHistory
from darko_gcs.state.traffic import LiveTraffic
from darko_gcs.station.plan_requests import FlightPlanRequests, PlanRequests
from darko_gcs.station.station import Station
from protocol.wire.codec import Codec


class RequestGroup:
    """In place of a group of requests: remembers them by "group.request", without their time.

    Only what the class in whose place it stands has may be asked, with the arguments that it takes.
    """

    def __init__(self, of, requests, group=""):
        self._of, self.requests, self._group = of, requests, group

    def __getattr__(self, request):
        called = inspect.signature(getattr(self._of, request))

        def remember(*args, **kwargs):
            called.bind(self, *args, **kwargs)
            self.requests.append((self._group + request, *args[:-1], *kwargs.items()))

        return remember


class RequestRecorder(RequestGroup):
    """In place of a station; what only asks is no request."""

    def __init__(self, snapshot):
        super().__init__(Station, [])
        self.snapshot, self.wanted_legs = snapshot, ()
        self.plans = RequestGroup(PlanRequests, self.requests, "plans.")
        self.flight_plan = RequestGroup(FlightPlanRequests, self.requests, "flight_plan.")

    def predict_legs(self, chains, _now):
        self.wanted_legs = tuple(chains)


class FakeFeed:
    """A feed that stands still."""

    def __init__(self, snapshot):
        self.snapshot, self.now = snapshot, 100.5
        self.station = RequestRecorder(snapshot)
        self.traffic, self.history = LiveTraffic(Codec(255, 190)), FieldHistory()
        self.closed, self.restart = False, None
        self.notes: list[str] = []
        self.fleet: Any = None

    @property
    def snapshot_now(self):
        return self.now

    @property
    def requests(self):
        return self.station.requests

    async def open(self):
        pass

    async def close(self):
        self.closed = True

    def note(self, text):
        self.notes.append(text)

    def advance(self, elapsed):
        pass


async def until(pilot, condition):
    """Wait for a condition, also on a busy machine; fail after many turns."""
    for _ in range(500):
        if condition():
            return
        await pilot.pause(0.02)
    assert condition(), screen_text(pilot.app)


async def confirm(pilot, key):
    """Press a key and answer its question with yes, once it is there."""
    await pilot.press(key)
    await until(pilot, lambda: hasattr(pilot.app.screen, "shown_at") and pilot.app.screen.is_mounted)
    await pilot.press("y")


async def settled(pilot):
    """Wait until the screen has stayed the same for ten turns, its colours as well."""
    shown, turns = None, 0

    def is_still():
        nonlocal shown, turns
        before, shown = shown, list(pilot.app.screen._compositor.render_strips())
        turns = turns + 1 if shown == before else 0
        return turns >= 10

    await until(pilot, is_still)


def screen_text(app):
    """The text on the screen."""
    width, height = app.size
    lines = app.screen._compositor.render_strips()
    return "\n".join("".join(segment.text for segment in strip)[:width] for strip in lines[:height])


def notices(app):
    """The text of all notices that are shown."""
    return " ".join(str(toast.render()) for toast in app.screen.query("Toast"))


def panel_text(panel, s, width=80, height=12):
    """The text that a panel draws for a snapshot."""
    return "\n".join(line_text(line) for line in panel.draw(s, width, height))


def line_text(line):
    """The text of a styled line."""
    return "".join(part for part, _ in line)


def lines_text(lines):
    """The text of several styled lines."""
    return "\n".join(line_text(line) for line in lines)


def styled_text(lines, style):
    """The text in one style."""
    return "".join(part for line in lines for part, name in line if name == style)
