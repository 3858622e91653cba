"""Serves the ground station to one browser at a time, on this machine alone (https://github.com/Textualize/textual-serve)."""

from __future__ import annotations

import asyncio
import logging
import math
import signal
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path

from aiohttp import WSMsgType, web
from textual_serve.app_service import AppService
from textual_serve.server import Server, to_int

from darko_gcs.live_page import HOST, OWN_NAMES

TEMPLATES = Path(__file__).with_name("templates")
CLOSED_AS_SECOND = 4001  # a code of our own (RFC 6455, 7.4.2), which the page tells from an end
MAX_HANDOVER_TIME = 5.0  # that a page which is being reloaded takes to let go of its station [s]
SECOND_INTERRUPT = 5.0  # within which a second Ctrl+C ends a station that runs [s]
HEARTBEAT = 15.0  # after which a browser that is silent counts as closed [s]
USUAL_SIZE = ("80", "24")  # of a page that does not tell its own [cells]
# A station that has begun in another page: alternate screen, mouse, hidden cursor, bracketed paste (xterm, ctlseqs).
TERMINAL_MODES = b"\x1b[?1049h\x1b[?1000h\x1b[?1003h\x1b[?1015h\x1b[?1006h\x1b[?25l\x1b[?2004h"


class KeptStation(AppService):
    """A ground station, and the page that shows it: it flies on while no page does."""

    def __init__(self, server: PageServer) -> None:
        super().__init__(
            server.command,
            write_bytes=self._show,
            write_str=self._tell,
            close=self._close_page,
            download_manager=server.download_manager,
        )
        self.page: web.WebSocketResponse | None = None
        self.has_ended = False

    async def follow(self, page: web.WebSocketResponse) -> None:
        """Take keys, sizes and focus from the page until it is closed."""
        async for message in page:
            if message.type != WSMsgType.TEXT:
                continue
            match message.json():
                case ["stdin", str(typed), *_]:
                    await self.send_bytes(typed.encode())
                case ["resize", {"width": int(width), "height": int(height)}, *_]:
                    await self.set_terminal_size(width, height)
                case ["ping", sent, *_]:
                    await page.send_json(["pong", sent])
                case ["blur", *_]:
                    await self.blur()
                case ["focus", *_]:
                    await self.focus()

    async def run(self) -> None:
        """Until it ends; the page tells its end."""
        await super().run()
        self.has_ended = True
        await self._close_page()

    async def _show(self, drawn: bytes) -> None:
        if self.page is not None and not self.page.closed:
            with suppress(ConnectionError):  # it is being closed: the station goes on
                await self.page.send_bytes(drawn)

    async def _tell(self, text: str) -> None:
        if self.page is not None and not self.page.closed:
            with suppress(ConnectionError):
                await self.page.send_str(text)

    async def _close_page(self) -> None:
        if self.page is not None:
            await self.page.close()


class PageServer(Server):
    """A page that shows the ground station, which runs from the first page on until its operator quits or this ends.

    Args:
        command: Starts the ground station, as a shell reads it.
        port: Of the page.
        live_port: Of the page that the ground station draws the vehicle on in 3-D.
    """

    def __init__(self, command: str, port: int, live_port: int) -> None:
        self._live_url = f"http://{HOST}:{live_port}/"
        super().__init__(command, HOST, port, "DarkO ground station", templates_path=TEMPLATES)
        self._one_page = asyncio.Lock()
        self._station: KeptStation | None = None
        self._interrupted = -math.inf  # when Ctrl+C was pressed last [s]

    def serve(self, debug: bool = False) -> None:  # noqa: ARG002 - as textual-serve has it
        """Serve until Ctrl+C, twice if a ground station runs; say where once the page can be opened.

        Raises:
            OSError: The port is taken.
        """
        logging.basicConfig(level=logging.ERROR, format="%(message)s")  # not each request
        web.run_app(self._make_app(), host=self.host, port=self.port, print=self._announce, access_log=None)

    async def _take_interrupts(self, _app: web.Application) -> None:
        asyncio.get_running_loop().add_signal_handler(signal.SIGINT, self.interrupt)

    def interrupt(self) -> None:
        """Ctrl+C in the terminal: end, if no ground station runs or it was pressed twice.

        Raises:
            GracefulExit: To end.
        """
        before, self._interrupted = self._interrupted, time.monotonic()
        is_running = self._station is not None and not self._station.has_ended
        if not is_running or self._interrupted - before <= SECOND_INTERRUPT:
            raise web.GracefulExit
        asked = f"Ctrl+C again within {SECOND_INTERRUPT:g} s ends it"
        print(f"The ground station runs, and a vehicle that flies would lose it: {asked}", flush=True)

    def _announce(self, *_texts: object) -> None:
        print(f"The ground station is on {self.public_url}; Ctrl+C ends it", flush=True)

    async def _make_app(self) -> web.Application:
        app = await super()._make_app()
        app.on_startup.append(self._take_interrupts)
        app.middlewares.append(refuse_strangers)
        app.router.add_get("/3d", self.lead_to_live_page)
        return app

    async def on_startup(self, app: web.Application) -> None:
        """Nothing: ``serve`` says where the page is."""

    async def on_shutdown(self, app: web.Application) -> None:  # noqa: ARG002 - as textual-serve has it
        """End the ground station, and with it a vehicle of ``--sitl``."""
        if self._station is not None:
            await self._station.stop()

    async def lead_to_live_page(self, _request: web.Request) -> web.StreamResponse:
        """Send the browser to the page in 3-D.

        Raises:
            HTTPFound: Always.
        """
        raise web.HTTPFound(self._live_url)

    async def handle_websocket(self, request: web.Request) -> web.WebSocketResponse:
        """Show the ground station in the page; a second page is closed, for two would fight for the vehicle."""
        page = web.WebSocketResponse(heartbeat=HEARTBEAT)
        await page.prepare(request)
        try:
            await asyncio.wait_for(self._one_page.acquire(), MAX_HANDOVER_TIME)
        except TimeoutError:
            await page.close(code=CLOSED_AS_SECOND)
            return page
        try:
            station = await self._shown_in(page, request)
            try:
                await station.follow(page)
            finally:
                station.page = None
        finally:
            self._one_page.release()
        return page

    async def _shown_in(self, page: web.WebSocketResponse, request: web.Request) -> KeptStation:
        """The station that runs, drawn anew in the page; a new one if none runs."""
        width, height = (
            to_int(request.query.get(name, usual), int(usual))
            for name, usual in zip(("width", "height"), USUAL_SIZE, strict=True)
        )
        if self._station is None or self._station.has_ended:
            self._station = KeptStation(self)
            self._station.page = page
            await self._station.start(width, height)
            return self._station
        await page.send_bytes(TERMINAL_MODES)
        self._station.page = page
        await self._station.set_terminal_size(width, height)
        await self._station.focus()
        return self._station


@web.middleware
async def refuse_strangers(
    request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
) -> web.StreamResponse:
    """Refuse what another site's page asks for: a browser lets any page connect to this machine.

    Raises:
        HTTPForbidden: The request names another host, or comes from the page of one.
    """
    own_origin = f"http://{request.host}"
    origin = request.headers.get("Origin", own_origin)
    if request.url.host not in OWN_NAMES:
        raise web.HTTPForbidden(text=f"{request.host} is not this machine")
    if origin != own_origin:
        raise web.HTTPForbidden(text=f"The page of {origin} may not fly this vehicle")
    return await handler(request)
