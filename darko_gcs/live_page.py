"""Serves a page that draws the vehicle in 3-D as it flies, on this machine alone, from the station's own snapshots."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Sequence
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Event, Thread
from types import TracebackType
from typing import Any, ClassVar
from urllib.parse import urlsplit

from darko_gcs.feed.feed import Feed
from darko_gcs.state.mission_items import place_of
from darko_gcs.state.snapshot import Snapshot
from protocol.dialect.vocabulary import Law
from protocol.flight_log.flight_charts import law_colour
from protocol.flight_log.flight_page import VIEW_SCRIPTS, document, page_part
from protocol.names import law_words, name_of

HOST = "127.0.0.1"
OWN_NAMES = frozenset({HOST, "localhost"})  # as which a browser on this machine asks for the page
PERIOD = 0.05  # in which a page is told what is new [s]
PULSE = 2.0  # in which a page is written to if nothing is: so it is noticed that it was closed [s]
MAX_PAGES = 8  # that are told at a time
STREAM = "/flight"


def live_state(s: Snapshot) -> dict[str, Any]:
    """Numbers that the page draws, as JSON has them; None for what is not known.

    ``time`` since boot [s]; ``place``, ``home``, ``target``, ``waypoints`` (number, place) NED [m]; ``attitude`` FRD
    with x along the nose -> NED; ``thrust`` [N], ``elevon`` [rad, positive nose-up]: left, right, or none; ``law``:
    label, colour; ``wind``: velocity of the air, NED [m/s]; ``status``: words.
    """
    acting, state, home = s.actuation.actuators, s.hybrid.state, s.position.home
    law = "" if state is None else name_of(Law, state.law)
    times = [at for at in (s.position.time, s.attitude.time, s.link.boot) if at is not None]
    places = enumerate(() if home is None else (place_of(item, home, s.position.home_p) for item in s.plans.mission))
    return {
        "vehicle": list(s.identity.source or ()),
        "time": max(times, default=None),
        "place": _known(s.position.p),
        "attitude": _known(s.attitude.q),
        "thrust": _known(acting and acting.thrust) or [],
        "elevon": _known(acting and acting.elevon) or [],
        "law": [law_words(law), law_colour(law)],
        "wind": _known(s.estimates.wind),
        "target": _known(s.goal),
        "home": None if home is None else _known(s.position.home_p),
        "waypoints": [[number, place] for number, point in places if (place := _known(point)) is not None],
        "status": _status(s),
    }


def _known(values: Sequence[float] | None) -> list[float] | None:
    if values is None or not all(map(math.isfinite, values)):
        return None
    return [round(value, 4) for value in values]


def _status(s: Snapshot) -> str:
    if s.identity.source is None:
        return "No vehicle yet"
    words = ["/".join(map(str, s.identity.source)), s.status.mode or "", "armed" if s.status.armed else "disarmed"]
    return ", ".join(filter(None, [*words, "LINK LOST: what is drawn is old" if s.link.lost else ""]))


class LivePage:
    """The page, served while the context lasts.

    Args:
        feed: Whose newest snapshot is drawn; read from another thread, which only looks at immutable values.
        port: Of the page; 0: any free one.

    Raises:
        OSError: The port is not free.
    """

    def __init__(self, feed: Feed, port: int) -> None:
        self._over = Event()
        handler = type("Handler", (_Handler,), {"feed": feed, "over": self._over, "streams": []})
        self._server = _Server((HOST, port), handler)
        self._thread = Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{HOST}:{self._server.server_address[1]}/"

    def __enter__(self) -> LivePage:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        self._server.shutdown()
        self._server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True  # pages that are still open do not hold the station

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - the standard library's types
        """Nothing, as of ``log_message``; the page says that it is not answered."""


class _Handler(BaseHTTPRequestHandler):
    """One request of a browser."""

    feed: ClassVar[Feed]
    over: ClassVar[Event]
    streams: ClassVar[list[object]]

    def do_GET(self) -> None:  # the standard library's name
        """Answer with the page, or with the stream of what is new."""
        asked, origin = self.headers.get("Host", ""), self.headers.get("Origin")
        if urlsplit(f"//{asked}").hostname not in OWN_NAMES or origin not in {None, f"http://{asked}"}:
            self.send_error(HTTPStatus.FORBIDDEN)  # a browser lets any page connect to this machine
        elif self.path == "/":
            self._send_page()
        elif self.path != STREAM:
            self.send_error(HTTPStatus.NOT_FOUND)
        elif len(self.streams) >= MAX_PAGES:
            self.send_error(HTTPStatus.SERVICE_UNAVAILABLE)
        else:
            self.streams.append(self)
            try:
                with suppress(OSError):  # the page was closed
                    self._stream()
            finally:
                self.streams.remove(self)

    def _send_page(self) -> None:
        content = page().encode()
        self._begin("text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def _stream(self) -> None:
        """Server-sent events, one for each change of the state."""
        self._begin("text/event-stream")
        self.end_headers()
        told, written = "", time.monotonic()
        while not self.over.wait(PERIOD):
            state, now = json.dumps(live_state(self.feed.snapshot), allow_nan=False), time.monotonic()
            if state != told:
                self.wfile.write(f"data: {state}\n\n".encode())
            elif now - written > PULSE:
                self.wfile.write(b":\n\n")
            else:
                continue
            told, written = state, now

    def _begin(self, kind: str) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002, ANN401 - the standard library's names
        """Nothing: the terminal has screens on it."""


def page() -> str:
    """The page: it asks for nothing but its stream."""
    scripts = "\n".join(map(page_part, (*VIEW_SCRIPTS, "live_page.js")))
    body = f'<p id="status">No vehicle yet</p><div id="view" class="whole"></div><script>{scripts}</script>'
    return document("DarkO in 3-D", body)
