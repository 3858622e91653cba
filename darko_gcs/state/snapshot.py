"""All the ground station knows at one moment: immutable, of parts by subject. None means "never received"."""

from __future__ import annotations

from typing import NamedTuple

from darko_gcs.state.flight_plan_state import FlightPlanState
from darko_gcs.state.parts import (
    Actuation,
    Attitude,
    Battery,
    Estimates,
    GuidanceStatus,
    HybridAutomaton,
    Identity,
    LinkStatus,
    MessageLog,
    MissionStatus,
    OperatorStatus,
    ParameterTable,
    Position,
    SessionStatus,
    VehiclePlans,
    VehicleStatus,
)
from darko_gcs.state.values import NetArena
from protocol.frames import Vector
from protocol.names import Mode


class Snapshot(NamedTuple):
    """State that the screens show. Each part tells its units and frames."""

    identity: Identity = Identity()
    status: VehicleStatus = VehicleStatus()
    link: LinkStatus = LinkStatus()
    session: SessionStatus = SessionStatus()
    attitude: Attitude = Attitude()
    position: Position = Position()
    estimates: Estimates = Estimates()
    guidance: GuidanceStatus = GuidanceStatus()
    hybrid: HybridAutomaton = HybridAutomaton()
    actuation: Actuation = Actuation()
    battery: Battery = Battery()
    parameters: ParameterTable = ParameterTable()
    plans: VehiclePlans = VehiclePlans()
    mission: MissionStatus = MissionStatus()
    flight_plan: FlightPlanState | None = None  # that the vehicle has loaded
    arena: NetArena | None = None  # under whose net it flies
    operator: OperatorStatus = OperatorStatus()
    log: MessageLog = MessageLog()

    @property
    def goal(self) -> Vector | None:
        """Present target of the vehicle, NED [m], in whichever way it tells so."""
        target, place = self.guidance.target, self.guidance.target_place
        if target is not None:
            return self.position.from_vehicle_frame(target)
        return None if place is None else self.position.local_by_own_place(place)

    @property
    def is_darko(self) -> bool:
        """True once the vehicle has told the state of its hybrid controller, which no other has."""
        return self.hybrid.state is not None

    @property
    def flies_plan(self) -> bool:
        """True while the vehicle flies its flight plan."""
        return self.flight_plan is not None and self.status.mode == Mode.FLIGHT_PLAN.name


EMPTY_SNAPSHOT = Snapshot()
