"""Messages of the simulated camera (https://mavlink.io/en/services/camera.html).

It is a camera that the autopilot has, device 1, and speaks from the autopilot's component: mission items are addressed
to that, and so are the commands that trigger a PX4's own camera. Stations ask the autopilot for its camera as well as
components 100 to 105.
"""

from __future__ import annotations

import math

from protocol import frames, units
from protocol.dialect import mavlink
from protocol.frames import LocalFrame, Vector
from protocol.wire.message import Message
from sitl.autopilot.camera import STORAGE_SIZE, Capture
from sitl.mavlink.telemetry.streams import StreamTable
from sitl.mavlink.telemetry.vehicle_snapshot import VehicleSnapshot

DEVICE = 1  # camera_device_id of a camera that is no component of its own
CAPABILITIES = (
    mavlink.CAMERA_CAP_FLAGS_CAPTURE_VIDEO
    | mavlink.CAMERA_CAP_FLAGS_CAPTURE_IMAGE
    | mavlink.CAMERA_CAP_FLAGS_HAS_MODES
    | mavlink.CAMERA_CAP_FLAGS_CAN_CAPTURE_IMAGE_IN_VIDEO_MODE
    | mavlink.CAMERA_CAP_FLAGS_CAN_CAPTURE_VIDEO_IN_IMAGE_MODE
    | mavlink.CAMERA_CAP_FLAGS_HAS_IMAGE_SURVEY_MODE
)
FOCAL_LENGTH, SENSOR = 16.0, (13.2, 8.8)  # [mm]
PIXELS = (5472, 3648)
NO_CAPTURE, INTERVAL_CAPTURE = 0, 3  # image_status
WHOLE_NAME, URI = 32, 140  # bytes of fields

CAMERA_STREAMS = StreamTable()


@CAMERA_STREAMS.sends(mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION, 0.0)
def camera_information(s: VehicleSnapshot) -> Message:
    """CAMERA_INFORMATION."""
    return mavlink.MAVLink_camera_information_message(
        time_boot_ms=s.ms,
        vendor_name=_bytes("DarkO"),
        model_name=_bytes("Simulated camera"),
        firmware_version=1,
        focal_length=FOCAL_LENGTH,
        sensor_size_h=SENSOR[0],
        sensor_size_v=SENSOR[1],
        resolution_h=PIXELS[0],
        resolution_v=PIXELS[1],
        lens_id=0,
        flags=CAPABILITIES,
        cam_definition_version=0,
        cam_definition_uri=bytes(URI),
        gimbal_device_id=0,
        camera_device_id=DEVICE,
    )


@CAMERA_STREAMS.sends(mavlink.MAVLINK_MSG_ID_CAMERA_SETTINGS, 0.0)
def camera_settings(s: VehicleSnapshot) -> Message:
    """CAMERA_SETTINGS: the lens is fixed."""
    return mavlink.MAVLink_camera_settings_message(
        time_boot_ms=s.ms, mode_id=s.camera.mode, zoomLevel=math.nan, focusLevel=math.nan, camera_device_id=DEVICE
    )


@CAMERA_STREAMS.sends(mavlink.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS, 0.0)
def camera_capture_status(s: VehicleSnapshot) -> Message:
    """CAMERA_CAPTURE_STATUS: images by distance have no interval."""
    camera = s.camera
    is_triggered = bool(camera.remaining or camera.distance) and not camera.paused
    since = camera.recording_since
    return mavlink.MAVLink_camera_capture_status_message(
        time_boot_ms=s.ms,
        image_status=INTERVAL_CAPTURE if is_triggered else NO_CAPTURE,
        video_status=int(since is not None),
        image_interval=camera.interval,
        recording_time_ms=0 if since is None else units.milliseconds(s.time - since),
        available_capacity=camera.free,
        image_count=camera.count,
        camera_device_id=DEVICE,
    )


@CAMERA_STREAMS.sends(mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION, 0.0)
def storage_information(s: VehicleSnapshot) -> Message:
    """STORAGE_INFORMATION."""
    return mavlink.MAVLink_storage_information_message(
        time_boot_ms=s.ms,
        storage_id=1,
        storage_count=1,
        status=mavlink.STORAGE_STATUS_READY,
        total_capacity=STORAGE_SIZE,
        used_capacity=STORAGE_SIZE - s.camera.free,
        available_capacity=s.camera.free,
        read_speed=0.0,
        write_speed=0.0,
        type=mavlink.STORAGE_TYPE_SD,
        name=_bytes("Simulated card"),
        storage_usage=mavlink.STORAGE_USAGE_FLAG_SET | mavlink.STORAGE_USAGE_FLAG_PHOTO,
    )


def image_captured(capture: Capture, frame: LocalFrame, home: Vector) -> Message:
    """CAMERA_IMAGE_CAPTURED: without a picture, so without an address of one.

    Args:
        capture: The image.
        frame: Where the world frame is.
        home: World NWU [m].
    """
    place = frame.to_geodetic(frames.flip(capture.p))
    return mavlink.MAVLink_camera_image_captured_message(
        time_boot_ms=units.milliseconds(capture.time),
        time_utc=0,
        camera_id=DEVICE,
        lat=units.to_e7(place.lat_deg),
        lon=units.to_e7(place.lon_deg),
        alt=units.millimetres(place.alt),
        relative_alt=units.millimetres(capture.p[2] - home[2]),
        q=list(capture.q),
        image_index=capture.number,
        capture_result=int(capture.is_stored),
        file_url=bytes(205),
    )


def _bytes(text: str) -> bytes:
    return text.encode("ascii").ljust(WHOLE_NAME, b"\0")
