"""Messages that say what the vehicle is and what it can do, one function each.

https://mavlink.io/en/messages/common.html#AUTOPILOT_VERSION, #PROTOCOL_VERSION and #COMPONENT_METADATA
"""

from __future__ import annotations

from protocol.dialect import mavlink
from protocol.wire.message import Message
from sitl.mavlink.files.component_metadata import GENERAL_URI, general_crc
from sitl.mavlink.telemetry.vehicle_snapshot import VehicleSnapshot


def autopilot_version(_s: VehicleSnapshot) -> Message:
    """AUTOPILOT_VERSION with the capabilities it really has."""
    capabilities = (
        mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT
        | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
        | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
        | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
        | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
        | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
        | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
        | mavlink.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET
        | mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
        | mavlink.MAV_PROTOCOL_CAPABILITY_FTP
    )
    return mavlink.MAVLink_autopilot_version_message(
        capabilities=capabilities,
        flight_sw_version=release_word(),
        middleware_sw_version=0,
        os_sw_version=0,
        board_version=0,
        flight_custom_version=[0] * 8,
        middleware_custom_version=[0] * 8,
        os_custom_version=[0] * 8,
        vendor_id=0,
        product_id=0,
        uid=0,
    )


def protocol_version(_s: VehicleSnapshot) -> Message:
    """PROTOCOL_VERSION: it understands MAVLink 1 and 2, and speaks 2."""
    return mavlink.MAVLink_protocol_version_message(
        version=200, min_version=100, max_version=200, spec_version_hash=[0] * 8, library_version_hash=[0] * 8
    )


def component_metadata(s: VehicleSnapshot) -> Message:
    """COMPONENT_METADATA: where the file is that describes the vehicle to ground stations."""
    return mavlink.MAVLink_component_metadata_message(
        time_boot_ms=s.ms, file_crc=general_crc(), uri=GENERAL_URI.encode("ascii")
    )


def release_word() -> int:
    """The package's version as AUTOPILOT_VERSION carries it."""
    from importlib.metadata import version  # noqa: PLC0415

    major, minor, patch = (int(part) for part in version("darko").split("."))
    return major << 24 | minor << 16 | patch << 8 | int(mavlink.FIRMWARE_VERSION_TYPE_OFFICIAL)
