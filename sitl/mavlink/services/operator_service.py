"""Operators and their parameters: who is in control, and what is set."""

from __future__ import annotations

from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.engines.table_values import Parameter
from protocol.events import OperatorChanged, OperatorRefused, OperatorRequested, ParameterChanged, ParameterRefused
from protocol.wire.message import Peer
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.watches import LinkSilence
from sitl.errors import SitlError
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.handlers import on_event
from sitl.tools.persistence import StateFolder
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings

# The ground station in control, and the time for which each link has been silent.
#
# https://mavlink.io/en/services/gcs_control.html, with one station in control at most: docs/failsafes.md.

CONTROL_BY_ARMING = 2  # DRK_ONE_GCS


class OperatorService:
    """Keeps endpoint and autopilot informed about each other's operators.

    Args:
        autopilot: Its settings decide who may command.
        endpoint: Admits commands, and hears heartbeats.
        broadcast: Tells everyone a text.
    """

    def __init__(self, autopilot: Autopilot, endpoint: VehicleEndpoint, broadcast: Broadcast) -> None:
        self._autopilot, self._endpoint, self._broadcast = autopilot, endpoint, broadcast

    def update(self, now: float) -> None:
        """Tell the autopilot about silent links, and the endpoint who may be in control.

        Args:
            now: The link's time [s].
        """
        operator, presence = self._endpoint.operator, self._endpoint.presence
        self._autopilot.failsafes.silence = LinkSilence(
            ground=presence.ground(now),
            in_control=None if operator.missed is None else presence.ground(now, operator.missed),
            companion=presence.companion(now),
        )
        operator.only_one = bool(self._autopilot.settings.control_policy)
        if not self._autopilot.armed:
            operator.disarmed()

    def armed_by(self, peer: Peer, now: float) -> None:
        """A peer has armed the vehicle, which may put it in control."""
        if self._autopilot.settings.control_policy == CONTROL_BY_ARMING:
            self._endpoint.operator.armed(peer, now)

    @on_event(OperatorChanged)
    def announce(self, event: OperatorChanged, _now: float) -> None:
        """Another station is in control, or none."""
        who = f"Ground station {event.system} is in control" if event.system else "No ground station is in control"
        self._broadcast.info(f"{who}: {event.why}")

    @on_event(OperatorRefused)
    def explain_refusal(self, event: OperatorRefused, _now: float) -> None:
        """A station commanded while another one is in control."""
        self._broadcast.complain(f"Ground station {event.peer.system} refused: {event.holder} is in control")

    @on_event(OperatorRequested)
    def pass_on_request(self, event: OperatorRequested, _now: float) -> None:
        """A station asks the one in control for control."""
        self._broadcast.complain(f"Ground station {event.peer.system} asks {event.holder} for control")


# Parameters as peers change them: put in force, saved, and refused with a reason.


class ParameterService:
    """Changes the aircraft's configuration, and saves the parameters that peers have set.

    Args:
        aircraft: Flies by them.
        state_folder: Stores them.
        endpoint: Tells everyone a parameter's value.
        broadcast: Tells everyone a text.
    """

    def __init__(
        self, aircraft: Aircraft, state_folder: StateFolder, endpoint: VehicleEndpoint, broadcast: Broadcast
    ) -> None:
        self._aircraft, self._state_folder = aircraft, state_folder
        self._endpoint, self._broadcast = endpoint, broadcast
        self._shown = aircraft.configuration
        self._saved = state_folder.parameters()

    def put_in_force(self, parameter: Parameter) -> str:
        """Fly by a parameter that a peer sets, within its bounds; why not, if it does not fit the others."""
        try:
            self._configure(self._aircraft.configuration.with_parameter(parameter))
        except SitlError as error:
            return str(error)
        return ""

    @on_event(ParameterChanged)
    def save(self, event: ParameterChanged, _now: float) -> None:
        """A peer has set a parameter, and it is in force."""
        self._saved[event.name] = event.value
        self._save()

    @on_event(ParameterRefused)
    def explain_refusal(self, event: ParameterRefused, _now: float) -> None:
        """A peer asked for an unknown parameter, or for a value that it cannot have."""
        what = event.name if event.value is None else f"{event.name} = {event.value:g}"
        self._broadcast.warn(f"{what} refused: {event.reason}")

    def reset(self) -> None:
        """Return all of them to their defaults; the ground, on which the vehicle may stand, at the next start."""
        world = WorldSettings().on_the_ground_of(self._aircraft.configuration.world)
        self._aircraft.configure(Configuration(world=world))
        self.show_changes()
        self._saved.clear()
        self._save()

    def show_changes(self) -> None:
        """Tell everyone which parameters the vehicle has changed by itself since the last call."""
        before, self._shown = self._shown, self._aircraft.configuration
        if self._shown is before:
            return
        for parameter in self._shown.wire_table():
            if before.value(parameter.name) != parameter.value:
                self._endpoint.set_parameter(parameter.name, parameter.value)

    def _configure(self, configuration: Configuration) -> None:
        self._aircraft.configure(configuration)
        self._shown = configuration

    def _save(self) -> None:
        self._broadcast.save(lambda: self._state_folder.save_parameters(self._saved))
