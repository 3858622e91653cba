"""The meaning of mission items and commands here, beside what PX4 and ArduPilot document: a table of ``docs/wire.md``.

To add an item or a command, add its row. "as here" is said of what differs in nothing that a plan can tell. Sources:
<https://docs.px4.io/main/en/flight_modes_vtol/mission>, PX4's ``src/modules/navigator`` where its guide is silent,
<https://ardupilot.org/plane/docs/common-mavlink-mission-command-messages-mav_cmd.html> and its page for Copter.
"""

from __future__ import annotations

from typing import NamedTuple

from protocol.dialect import mavlink as m


class Meaning(NamedTuple):
    """One item or command: what it does here, of a PX4 and of an ArduPilot."""

    here: str
    px4: str
    ardupilot: str


TAKE_OFF_MEANING = Meaning(
    "Climbs straight up at MPC_TKO_SPEED, then hovers to its place. Met in the air it is passed over, and said; a "
    "climb that was interrupted goes on.",
    "Climbs, also to a place; in the air it is a waypoint. VTOL_TAKEOFF ends with a front transition.",
    "Climbs straight up; in the air it climbs if it is lower, else it is passed over.",
)
LAND_MEANING = Meaning(
    "Flies to its place (0, 0: here) at its height or higher, stands upright, descends at MPC_LAND_SPEED, disarms. A "
    "landing within a mission: arm and start again to go on.",
    "The same; a VTOL in forward flight transitions back first. Yaw is ignored.",
    "The same; Plane lands a fixed wing by LAND, a QuadPlane by VTOL_LAND.",
)
CONDITION_WORDS = (
    "The DO items after it wait while the next item is flown; those that still wait at its end are passed over, and "
    "said. With nothing to fly after it the vehicle waits where it is."
)
CAPTURE_WORDS = "Each image is a CAMERA_IMAGE_CAPTURED."
LOITER_WORDS = "In forward flight a circle with a radius (param3; without one it hovers at the place)"

ITEM_MEANINGS: dict[int, Meaning] = {
    m.MAV_CMD_NAV_WAYPOINT: Meaning(
        "param1 hold, param2 radius (0: NAV_ACC_RAD), param4 yaw where it stops. With a hold it stops; without, it is "
        "passed in forward flight within param2, or as near as a right angle is turned (16 m at 15 m/s), and within "
        "NAV_FW_ALT_RAD of its height, after a circle where the leg is too short or too steep.",
        "as here; a fixed wing ignores hold and radius",
        "param1 hold (Copter), param2 radius and param3 pass-by (Plane)",
    ),
    m.MAV_CMD_NAV_LOITER_UNLIM: Meaning(f"{LOITER_WORDS}, until another order.", "as here", "as here"),
    m.MAV_CMD_NAV_LOITER_TURNS: Meaning(
        f"{LOITER_WORDS} for param1 turns from the circle on; radius 0 is NAV_LOITER_RAD. Hovering it is passed.",
        "not supported",
        "as here; Copter turns on the spot for radius 0",
    ),
    m.MAV_CMD_NAV_LOITER_TIME: Meaning(
        f"{LOITER_WORDS} for param1 seconds from the circle or the place on.", "as here", "as here"
    ),
    m.MAV_CMD_NAV_RETURN_TO_LAUNCH: Meaning(
        "Returns to home or the nearest rally point at RTL_RETURN_ALT or higher, and lands.",
        "as here, by RTL_TYPE also along the mission",
        "Copter as here; Plane circles there",
    ),
    m.MAV_CMD_NAV_LAND: LAND_MEANING,
    m.MAV_CMD_NAV_TAKEOFF: TAKE_OFF_MEANING,
    m.MAV_CMD_NAV_VTOL_TAKEOFF: TAKE_OFF_MEANING,
    m.MAV_CMD_NAV_VTOL_LAND: LAND_MEANING,
    m.MAV_CMD_NAV_LOITER_TO_ALT: Meaning(
        "In forward flight circles with radius param2 (0: NAV_LOITER_RAD) until within 2 m of its height, and leaves "
        "towards the next item if param1 or param4 is 1; hovering it goes to its point.",
        "as here (fixed wing), param4 the exit's place",
        "as here; Copter climbs at the point",
    ),
    m.MAV_CMD_DO_LAND_START: Meaning(
        "Passed over. RTL_TYPE 1 and 3: a return, also of a failsafe, flies from the nearest one on.",
        "as here; RTL_TYPE 2 and 4 along the mission",
        "Plane: by RTL_AUTOLAND; Copter: the mode Auto RTL",
    ),
    m.MAV_CMD_CONDITION_DELAY: Meaning(f"For param1 seconds. {CONDITION_WORDS}", "not supported", "as here"),
    m.MAV_CMD_CONDITION_DISTANCE: Meaning(
        f"Until the next item is param1 metres away, level. {CONDITION_WORDS}", "not supported", "as here"
    ),
    m.MAV_CMD_CONDITION_YAW: Meaning(
        "Turns the belly to param1, at param2 deg/s (0, and at most: 30), the way of param3, from the present heading "
        f"if param4 is 1, until the next item ends; in forward flight it is met at once. {CONDITION_WORDS}",
        "not supported",
        "Copter as here",
    ),
    m.MAV_CMD_DO_SET_HOME: Meaning(
        "Home is here (param1 1), or at its place; a place that fence, arena or mission forbid is refused in flight.",
        "as here",
        "as here",
    ),
    m.MAV_CMD_DO_FENCE_ENABLE: Meaning(
        "0: no fence until the vehicle is disarmed, 1: the fence of GF_ACTION again. No floor (2).",
        "not supported",
        "0, 1, and 2 for the floor",
    ),
    m.MAV_CMD_DO_SET_ROI_LOCATION: Meaning(
        "The hovering vehicle turns its belly there (not in a wind that asks for the span edge-on, not while landing), "
        "and the camera looks there in forward flight too, until NONE, another order to the mount, or a new start.",
        "a multicopter turns, the mount points",
        "Copter turns if the mount cannot, the mount points",
    ),
    m.MAV_CMD_DO_SET_ROI: Meaning(
        "With a place as DO_SET_ROI_LOCATION, whatever param1; without: param1 0 none, 1 along the way.",
        "by param1",
        "a place, or none",
    ),
    m.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: Meaning(
        "The camera looks along the course, param5 up and param7 clockwise of it; the vehicle does not turn.",
        "the mount points to the next waypoint",
        "not supported",
    ),
    m.MAV_CMD_DO_SET_ROI_NONE: Meaning(
        "Ends the region of interest; the camera is fixed to the body again.", "as here", "as here"
    ),
    m.MAV_CMD_DO_MOUNT_CONFIGURE: Meaning("Accepted: there is nothing to configure.", "as here", "the mount's mode"),
    m.MAV_CMD_DO_MOUNT_CONTROL: Meaning(
        "The camera looks param1 up and param3 clockwise of the heading, level (param7 2); fixed to the body "
        "otherwise (0, 1). No roll.",
        "as here",
        "as here; param7 other",
    ),
    m.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: Meaning(
        "As DO_MOUNT_CONTROL by param1 and param2, from north if param5 locks the yaw; at once, without a rate.",
        "with rates",
        "with rates",
    ),
    m.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: Meaning("Accepted: everyone may point it.", "who may point it", "as PX4"),
    m.MAV_CMD_DO_DIGICAM_CONTROL: Meaning(f"Takes an image. {CAPTURE_WORDS}", "as here", "if param5 is 1"),
    m.MAV_CMD_DO_SET_CAM_TRIGG_DIST: Meaning(
        f"An image every param1 metres over the ground, the first at once if param3 is 1; 0 ends it. {CAPTURE_WORDS} "
        "Leaving the mission suspends it.",
        "as here",
        "as here",
    ),
    m.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL: Meaning(
        f"An image every param1 milliseconds; 0 or -1 ends it. {CAPTURE_WORDS}", "as here", "not supported"
    ),
    m.MAV_CMD_SET_CAMERA_MODE: Meaning(
        "param2; images and videos are taken in each.", "by the camera", "by the camera"
    ),
    m.MAV_CMD_IMAGE_START_CAPTURE: Meaning(
        f"param3 images (0: until stopped) every param2 seconds, not faster than every 0.1 s. {CAPTURE_WORDS} Leaving "
        "the mission suspends it.",
        "by the camera",
        "as here",
    ),
    m.MAV_CMD_IMAGE_STOP_CAPTURE: Meaning("Ends images by time.", "by the camera", "as here"),
    m.MAV_CMD_VIDEO_START_CAPTURE: Meaning("CAMERA_CAPTURE_STATUS tells of it.", "by the camera", "as here"),
    m.MAV_CMD_VIDEO_STOP_CAPTURE: Meaning("CAMERA_CAPTURE_STATUS tells of it.", "by the camera", "as here"),
    m.MAV_CMD_NAV_DELAY: Meaning("Waits param1 seconds; no time of day.", "as here", "as here, or a time of day"),
    m.MAV_CMD_DO_JUMP: Meaning(
        "To item param1, param2 times (-1: for ever). Counters begin anew with an upload, with a start from the first "
        "item, after the mission was complete, and by DO_SET_MISSION_CURRENT's reset.",
        "as here",
        "as here; 15 jumps at most in older versions",
    ),
    m.MAV_CMD_DO_CHANGE_SPEED: Meaning(
        "Up to DRK_HOV_VMAX the ground speed of the hover; from 7 m/s the cruise, through the air (param1 0) or over "
        "the ground (1: by the wind at the start of each leg). 2 and 3: how fast hovered legs climb (take-offs too) "
        "and descend. param2: -1 no change, -2 default. A throttle is refused. Acts at once, until the mission begins "
        "anew.",
        "types are one; 0 or less is the default; throttle only without a speed",
        "Copter: 0 and 1 level, 2 climb, 3 descent; Plane: 0 airspeed, 1 least ground speed, and throttle",
    ),
    m.MAV_CMD_DO_VTOL_TRANSITION: Meaning(
        "3: hover the legs to come, 4: fly them forward where possible, 0: choose again. No wait of its own.",
        "3 and 4; the item ends with the transition",
        "3 and 4 (QuadPlane)",
    ),
}
TAKE_OFF_COMMAND = Meaning(
    "Straight up where it stands, to param7 (NaN: MIS_TAKEOFF_ALT); disarmed, it waits 20 s for arming. In the air "
    "it is refused.",
    "the same, without a limit of time",
    "armed and in GUIDED",
)
LAND_COMMAND = Meaning("Stops and lands there; a place is ignored.", "as here", "as here")
COMMAND_MEANINGS: dict[int, Meaning] = {
    m.MAV_CMD_NAV_TAKEOFF: TAKE_OFF_COMMAND,
    m.MAV_CMD_NAV_VTOL_TAKEOFF: TAKE_OFF_COMMAND,
    m.MAV_CMD_NAV_LAND: LAND_COMMAND,
    m.MAV_CMD_NAV_VTOL_LAND: LAND_COMMAND,
    m.MAV_CMD_NAV_RETURN_TO_LAUNCH: Meaning("As the item, in mode RTL.", "as here", "as here"),
    m.MAV_CMD_NAV_LOITER_UNLIM: Meaning("Holds, upright; with a place it is refused.", "as here", "as here"),
    m.MAV_CMD_DO_SET_MODE: Meaning(
        "PX4's main and sub mode. Disarmed on the ground every mode is taken; in RTL and LAND it is not armed.",
        "as here",
        "its own numbers",
    ),
    m.MAV_CMD_COMPONENT_ARM_DISARM: Meaning(
        "On the ground, if the checks pass; param2 21196 forces either.", "as here", "2989 forces arming"
    ),
    m.MAV_CMD_DO_REPOSITION: Meaning(
        "A place by COMMAND_INT, hovered or flown forward to, then held; param1 limits the hover's speed, param4 is "
        "the heading there. Without a place another height (round the circle if one is flown) or heading; without any: "
        "hold.",
        "as here; a fixed wing circles there with radius param3",
        "in GUIDED, or with the flag that changes the mode",
    ),
    m.MAV_CMD_DO_CHANGE_ALTITUDE: Meaning(
        "Height param1 in frame param2, where the vehicle is to be or round the circle that it flies.",
        "as here",
        "Plane, in GUIDED",
    ),
    m.MAV_CMD_DO_ORBIT: Meaning(
        "Flown forward for ever, not tighter than 5 m/s2; NaN: NAV_LOITER_RAD, here, at this height.",
        "a hover orbits with any yaw; a fixed wing loiters",
        "not documented",
    ),
    m.MAV_CMD_CONDITION_YAW: Meaning(
        "Turns the belly while the vehicle holds in the hover. The other conditions, and DO_LAND_START, are items "
        "alone; camera, mount, region of interest and fence are ordered as by the items.",
        "as DO_REPOSITION's yaw",
        "Copter as here",
    ),
    m.MAV_CMD_MISSION_START: Meaning(
        "From item param1; NaN: from the current one. 0 without param2 (0): the mission under way goes on; on the "
        "ground it begins anew if it was broken off. From item 0, or complete before, it is as after an upload.",
        "sets the item, changes the mode",
        "changes the mode to AUTO; MIS_RESTART decides whether it resumes",
    ),
    m.MAV_CMD_DO_SET_MISSION_CURRENT: Meaning(
        "The mode stays. param1 -1: the current item. param2 1 resets counters, speeds and ways of flying, and lets a "
        "complete mission go on. Out of range: FAILED.",
        "param1 only",
        "as here",
    ),
    m.MAV_CMD_DO_PAUSE_CONTINUE: Meaning("0 holds, upright; 1 goes on with the current item.", "as here", "as here"),
    m.MAV_CMD_DO_CHANGE_SPEED: Meaning(
        "As the item, for the manoeuvre under way: a hover takes no cruise speed, a cruise no hover speed.",
        "as the item",
        "as the item",
    ),
    m.MAV_CMD_DO_VTOL_TRANSITION: Meaning(
        "IN_PROGRESS until it hovers or flies on the wing; EXTENDED_SYS_STATE says so before the ACCEPTED. Forward "
        "outside a mission: a circle ahead.",
        "ACCEPTED at the start",
        "ACCEPTED at the start",
    ),
}
AUTOCONTINUE = """An item whose autocontinue is 0 pauses the mission after it: the vehicle holds there and says so,
until MISSION_START, DO_PAUSE_CONTINUE or the mode goes on. PX4 stays at the item until another is chosen;
ArduPilot ignores the field."""
