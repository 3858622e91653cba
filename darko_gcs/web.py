"""Serves the ground station to one browser at a time, on this machine alone (https://github.com/Textualize/textual-serve)."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from pathlib import Path

from aiohttp import web
from textual_serve.server import Server

from darko_gcs.live_page import HOST, OWN_NAMES

TEMPLATES = Path(__file__).with_name("templates")
CLOSED_AS_SECOND = 4001  # a code of our own (RFC 6455, 7.4.2), which the page tells from an end
MAX_HANDOVER_TIME = 5.0  # that a page which is being reloaded takes to end its station [s]


class PageServer(Server):
    """A page that runs the ground station for as long as it is open.

    Args:
        command: Starts the ground station, as a shell reads it.
        port: Of the page.
        live_port: Of the page that the ground station draws the vehicle on in 3-D.
    """

    def __init__(self, command: str, port: int, live_port: int) -> None:
        self._live_url = f"http://{HOST}:{live_port}/"
        super().__init__(command, HOST, port, "DarkO ground station", templates_path=TEMPLATES)
        self._station = asyncio.Lock()

    def serve(self, debug: bool = False) -> None:  # noqa: ARG002 - as textual-serve has it
        """Serve until Ctrl+C; say where once the page can be opened.

        Raises:
            OSError: The port is taken.
        """
        logging.basicConfig(level=logging.ERROR, format="%(message)s")  # not each request
        web.run_app(self._make_app(), host=self.host, port=self.port, print=self._announce, access_log=None)

    def _announce(self, *_texts: object) -> None:
        print(f"The ground station is on {self.public_url}; Ctrl+C ends it", flush=True)

    async def _make_app(self) -> web.Application:
        app = await super()._make_app()
        app.middlewares.append(refuse_strangers)
        app.router.add_get("/3d", self.lead_to_live_page)
        return app

    async def on_startup(self, app: web.Application) -> None:
        """Nothing: ``serve`` says where the page is."""

    async def lead_to_live_page(self, _request: web.Request) -> web.StreamResponse:
        """Send the browser to the page in 3-D.

        Raises:
            HTTPFound: Always.
        """
        raise web.HTTPFound(self._live_url)

    async def handle_websocket(self, request: web.Request) -> web.WebSocketResponse:
        """Run the ground station for the page; a second page is closed, for two would fight for the vehicle."""
        try:
            await asyncio.wait_for(self._station.acquire(), MAX_HANDOVER_TIME)
        except TimeoutError:
            refused = web.WebSocketResponse()
            await refused.prepare(request)
            await refused.close(code=CLOSED_AS_SECOND)
            return refused
        try:
            return await super().handle_websocket(request)
        finally:
            self._station.release()


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
