"""The ground station in control, and the time for which each link has been silent.

https://mavlink.io/en/services/gcs_control.html, with one station in control at most: docs/failsafes.md.
"""

from __future__ import annotations

from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.events import OperatorChanged, OperatorRefused, OperatorRequested
from protocol.wire.message import Peer
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.watches import LinkSilence
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.handlers import on_event

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
