"""The two ends of a link, each a composition of engines, without sockets or clocks."""

from protocol.endpoint_ground import GroundEndpoint
from protocol.endpoint_vehicle import VehicleEndpoint

__all__ = ["GroundEndpoint", "VehicleEndpoint"]
