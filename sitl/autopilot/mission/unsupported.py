"""Refusals of items that other vehicles carry out: each names what this one lacks."""

from __future__ import annotations

from protocol.dialect import mavlink

REASONS = {
    mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT: "splines are not flown: use waypoints",
    mavlink.MAV_CMD_NAV_FOLLOW: "there is nothing that it could follow",
    mavlink.MAV_CMD_NAV_CONTINUE_AND_CHANGE_ALT: "use NAV_LOITER_TO_ALT",
    mavlink.MAV_CMD_NAV_PAYLOAD_PLACE: "the vehicle has no gripper and no winch",
    mavlink.MAV_CMD_NAV_GUIDED_ENABLE: "use the mode OFFBOARD",
    mavlink.MAV_CMD_CONDITION_CHANGE_ALT: "use NAV_LOITER_TO_ALT",
    mavlink.MAV_CMD_DO_SET_MODE: "a mission does not change its mode: use NAV_RETURN_TO_LAUNCH or NAV_LAND",
    mavlink.MAV_CMD_DO_SET_PARAMETER: "a mission does not change parameters",
    mavlink.MAV_CMD_DO_SET_RELAY: "the vehicle has no relay",
    mavlink.MAV_CMD_DO_REPEAT_RELAY: "the vehicle has no relay",
    mavlink.MAV_CMD_DO_SET_SERVO: "the vehicle has no servo outputs to spare",
    mavlink.MAV_CMD_DO_REPEAT_SERVO: "the vehicle has no servo outputs to spare",
    mavlink.MAV_CMD_DO_SET_ACTUATOR: "the vehicle has no actuators to spare",
    mavlink.MAV_CMD_DO_PARACHUTE: "the vehicle has no parachute",
    mavlink.MAV_CMD_DO_MOTOR_TEST: "motors are not tested in flight",
    mavlink.MAV_CMD_DO_INVERTED_FLIGHT: "the vehicle does not fly inverted",
    mavlink.MAV_CMD_DO_GRIPPER: "the vehicle has no gripper",
    mavlink.MAV_CMD_DO_WINCH: "the vehicle has no winch",
    mavlink.MAV_CMD_SET_CAMERA_ZOOM: "the camera has a fixed lens",
    mavlink.MAV_CMD_SET_CAMERA_FOCUS: "the camera has a fixed lens",
}


def refusal_of(command: int) -> str:
    """A sentence about a command that no mission may have here."""
    entry = mavlink.enums["MAV_CMD"].get(command)
    name = f"command {command}" if entry is None else f"{str(entry.name).removeprefix('MAV_CMD_')} ({command})"
    reason = REASONS.get(command)
    return f"{name} is not supported" + (f": {reason}" if reason else "")
