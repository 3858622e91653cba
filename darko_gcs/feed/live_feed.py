"""Snapshots of a vehicle on the link."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence

from darko_gcs.errors import LinkError
from darko_gcs.feed.links import link_to, outward_address
from darko_gcs.feed.sitl_process import SitlProcess
from darko_gcs.state.field_history import FieldHistory
from darko_gcs.state.number_ranges import parse_number
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.traffic import LiveTraffic
from darko_gcs.state.values import Simulator
from darko_gcs.station.fleet import Fleet, InitialSync
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.events import VehicleFound
from protocol.tools.option_values import open_port_warning


class LiveFeed:
    """A vehicle on the link, and the vehicle process if we start it.

    Args:
        station: Has the link, and talks to the first vehicle on it.
        host: Local address to listen on, or an address to connect to (``udpout:``, ``tcp:``, ``serial:``).
        port: Local UDP port; 0: any.
        sitl: Arguments of the vehicle process to start; None starts none.
        greeting: First line of the message log.
        api_port: Where the vehicle process also sends to, for other programs; 0: nowhere.
    """

    def __init__(
        self,
        station: Station,
        host: str,
        port: int,
        sitl: Sequence[str] | None,
        *,
        greeting: str = "",
        api_port: int = 0,
    ) -> None:
        self.fleet = Fleet(station)
        self._link = link_to(station, host)
        self._host, self._port, self._sitl = host, port, sitl
        self._greeting, self._api_port = greeting, api_port
        self._process: SitlProcess | None = None
        self._syncs: dict[Station, InitialSync] = {}  # of the vehicles that were shown so far

    @property
    def station(self) -> Station:
        """The station of the active vehicle."""
        return self.fleet.active

    @property
    def traffic(self) -> LiveTraffic:
        """Every message of the link."""
        return self.fleet.lead.traffic

    @property
    def history(self) -> FieldHistory:
        """The active vehicle's messages since it is the active one."""
        return self.fleet.lead.history

    @property
    def snapshot(self) -> Snapshot:
        """The newest snapshot."""
        return self.station.snapshot

    @property
    def now(self) -> float:
        """The link's clock [s]."""
        return self._link.now

    @property
    def snapshot_now(self) -> float:
        """The same: the snapshot's times are by the link's clock [s]."""
        return self._link.now

    async def open(self) -> None:
        """Listen, and start the vehicle process if asked to.

        Raises:
            LinkError: If the port is not available or the process cannot be started.
        """
        await self._link.open(self._host, self._port)
        self._log(self._link.words)
        is_listening = outward_address(self._host) is None
        if is_listening:
            session = self.station.snapshot.session._replace(port=self._link.port)
            self.station.snapshot = self.station.snapshot._replace(session=session)
        if is_listening and (warning := open_port_warning(self._host, signed=self.fleet.lead.endpoint.keyring.is_on)):
            self._log(warning)
        if self._greeting:
            self._log(self._greeting)
        if self._sitl is not None:
            await self._start(self._sitl)

    @property
    def restart(self) -> Callable[[], Awaitable[None]] | None:
        """Stops our vehicle process if it still runs, and starts it again; None if we started none."""
        return None if self._sitl is None else self._restart

    async def _restart(self) -> None:
        process, self._process = self._process, None
        if process is None:  # another restart is under way
            return
        await process.stop()
        try:
            await self._start(self._sitl or ())
        except LinkError as error:
            self._process = process
            self._set_simulator(Simulator.ENDED)
            self._log(str(error))

    async def _start(self, arguments: Sequence[str]) -> None:
        self._set_simulator(Simulator.STARTING)
        self._process = await SitlProcess.start(self._link.port, arguments, self._log, self._api_port)

    def _set_simulator(self, state: Simulator) -> None:
        for station in self.fleet.every:
            session = station.snapshot.session
            if state is not session.simulator:
                session = session._replace(simulator=state, simulator_since=self._link.now)
                station.snapshot = station.snapshot._replace(
                    session=session._replace(simulation_speed=_simulation_speed(self._sitl or ()))
                )

    def note(self, text: str) -> None:
        """Put a text into the recording."""
        self.fleet.lead.record_note(text, self._link.now, self._link.time_usec())

    async def close(self) -> None:
        """Stop our vehicle process, release the port, close the recording."""
        if self._process is not None:
            await self._process.stop()
        await self._link.close()

    def advance(self, elapsed: float) -> None:  # noqa: ARG002 - the link has its own clock
        """Sync with a vehicle that is new or shown for the first time; report when our process ends by itself."""
        self.history.follow(self.station.endpoint.vehicle)
        for station in self.fleet.every:
            self._follow(station)
        if self._process is None:
            return
        if self._process.ending and self.snapshot.session.simulator is not Simulator.ENDED:
            self._set_simulator(Simulator.ENDED)
            self._log(f"{self._process.ending} (Ctrl+R restarts it)")
        elif self._process.is_ready and self.snapshot.session.simulator is Simulator.STARTING:
            self._set_simulator(Simulator.RUNNING)

    def _follow(self, station: Station) -> None:
        """Sync with a vehicle once it is shown: of twenty vehicles, nineteen need not send their plans."""
        events = station.events()
        if station is self.station and station not in self._syncs:
            self._syncs[station] = InitialSync(station)
            vehicle = station.endpoint.vehicle
            events = events if vehicle is None else [VehicleFound(*vehicle), *events]
        if station in self._syncs:
            self._syncs[station].follow(events, self._link.now)

    def _log(self, text: str) -> None:
        self.station.add_line(self._link.now, text, mavlink.MAV_SEVERITY_NOTICE)


def _simulation_speed(arguments: Sequence[str]) -> float:
    """Of the simulator's arguments, times real time; 1 if they do not tell one."""
    words = list(arguments)
    told = words[words.index("--speed") + 1 : words.index("--speed") + 2] if "--speed" in words else []
    return next(filter(None, (parse_number(text) for text in told)), 1.0)
