"""The two ends of a link, each a composition of engines, without sockets or clocks."""

from protocol.endpoint_ground import GROUND_SYSTEM, GroundEndpoint
from protocol.endpoint_vehicle import VehicleEndpoint

__all__ = ["GROUND_SYSTEM", "GroundEndpoint", "VehicleEndpoint"]
