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
    px4: str = "as here"
    ardupilot: str = "as here"


ITEM_WORDS = """An item whose autocontinue is 0 pauses the mission after it: the vehicle holds and says so, until
MISSION_START, DO_PAUSE_CONTINUE or the mode goes on. (PX4 stays at the item until another is chosen; ArduPilot ignores
the field.) After a condition the DO items wait while the next item is flown; those still waiting at its end are passed
over, and said. With nothing to fly after it the vehicle waits where it is. (PX4 knows no conditions.) Each image is a
CAMERA_IMAGE_CAPTURED. Leaving the mission suspends images by distance or time. (On PX4 images, videos and modes are the
camera's.) In italics: where PX4 and ArduPilot (Plane, Copter) document something else."""
COMMAND_WORDS = "Conditions but CONDITION_YAW, and DO_LAND_START, are refused: they are items alone."

TAKE_OFF_MEANING = Meaning(
    "Climbs straight up at MPC_TKO_SPEED, then hovers to its place. In the air it is passed over, and said; a climb "
    "that was interrupted goes on.",
    "takes it in the air for a waypoint, and ends VTOL_TAKEOFF with a front transition",
    "in the air climbs if it is lower",
)
LAND_MEANING = Meaning(
    "Flies to its place (0, 0: here) at its height or higher, stands upright, descends at MPC_LAND_SPEED, disarms. "
    "Within a mission: arm and start again to go on.",
    "ignores yaw",
    "Plane lands a fixed wing by LAND, a QuadPlane by VTOL_LAND",
)
LOITER_WORDS = "In forward flight a circle"

ITEM_MEANINGS: dict[int, Meaning] = {
    m.MAV_CMD_NAV_WAYPOINT: Meaning(
        "With a hold it stops, turned to yaw; without, it is passed in forward flight within the radius "
        "(0: NAV_ACC_RAD), or as near as a right angle is turned (16 m at 15 m/s), and within "
        "NAV_FW_ALT_RAD of its height, after a circle where the leg is too short or too steep.",
        "ignores hold and radius on a fixed wing",
        "Plane does not hold, and passes by at param3",
    ),
    m.MAV_CMD_NAV_LOITER_UNLIM: Meaning(
        f"{LOITER_WORDS} until another order; without a radius, or hovering, it hovers there."
    ),
    m.MAV_CMD_NAV_LOITER_TURNS: Meaning(
        f"{LOITER_WORDS} (radius 0: NAV_LOITER_RAD); hovering it is passed.",
        "does not know it",
        "Copter turns on the spot for radius 0",
    ),
    m.MAV_CMD_NAV_LOITER_TIME: Meaning("As LOITER_UNLIM; the time begins on the circle or at the place."),
    m.MAV_CMD_NAV_RETURN_TO_LAUNCH: Meaning(
        "Returns to home or the nearest rally point at RTL_RETURN_ALT or higher, and lands.",
        "by RTL_TYPE also along the mission",
        "Plane circles there",
    ),
    m.MAV_CMD_NAV_LAND: LAND_MEANING,
    m.MAV_CMD_NAV_TAKEOFF: TAKE_OFF_MEANING,
    m.MAV_CMD_NAV_VTOL_TAKEOFF: TAKE_OFF_MEANING,
    m.MAV_CMD_NAV_VTOL_LAND: LAND_MEANING,
    m.MAV_CMD_NAV_LOITER_TO_ALT: Meaning(
        "In forward flight circles (radius 0: NAV_LOITER_RAD) until within 2 m of its height, and leaves towards the "
        "next item if param1 or param4 is 1; hovering it goes to its point.",
        "takes param4 for the exit's place",
        "Copter climbs at the point",
    ),
    m.MAV_CMD_DO_LAND_START: Meaning(
        "Passed over. With RTL_TYPE 1 and 3 a return, also of a failsafe, flies from the nearest one on.",
        "by RTL_TYPE 2 and 4 along the mission",
        "Plane by RTL_AUTOLAND, Copter by Auto RTL",
    ),
    m.MAV_CMD_CONDITION_DELAY: Meaning("The DO items after it wait that long."),
    m.MAV_CMD_CONDITION_DISTANCE: Meaning("They wait until the next item is that near, level."),
    m.MAV_CMD_CONDITION_YAW: Meaning(
        "Turns the belly (rate 0, and at most: 30 deg/s) until the next item ends; in forward flight it is met at once."
    ),
    m.MAV_CMD_DO_SET_HOME: Meaning(
        "Home is here (1), or at its place; one that fence, arena or mission forbid is refused in flight."
    ),
    m.MAV_CMD_DO_FENCE_ENABLE: Meaning(
        "0: no fence until the vehicle is disarmed, 1: the fence of GF_ACTION again.",
        "does not know it",
        "has 2 for the floor",
    ),
    m.MAV_CMD_DO_SET_ROI_LOCATION: Meaning(
        "The hovering vehicle turns its belly there (not in a wind that asks for the span edge-on, not while landing), "
        "the camera looks there in forward flight too, until NONE, another order to the mount, or a new start.",
        "as a multicopter",
        "Copter turns if the mount cannot",
    ),
    m.MAV_CMD_DO_SET_ROI: Meaning(
        "With a place as DO_SET_ROI_LOCATION; without: param1 0 none, 1 along the way.",
        "by param1",
        "has a place, or none",
    ),
    m.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: Meaning(
        "The camera looks that far up and clockwise of the course; the vehicle does not turn.",
        "points it to the next waypoint",
        "does not know it",
    ),
    m.MAV_CMD_DO_SET_ROI_NONE: Meaning("No region of interest; the camera is fixed to the body again."),
    m.MAV_CMD_DO_MOUNT_CONFIGURE: Meaning("Accepted: nothing to configure.", ardupilot="sets the mount's mode"),
    m.MAV_CMD_DO_MOUNT_CONTROL: Meaning(
        "The camera looks up and clockwise of the heading, level (mode 2), or is fixed to the body (0, 1). No roll.",
        ardupilot="numbers param7 otherwise",
    ),
    m.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: Meaning(
        "As DO_MOUNT_CONTROL, from north if the flags lock the yaw; no rates.",
        "with rates",
        "with rates",
    ),
    m.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: Meaning(
        "Accepted: everyone may point it.", "choose who may", "choose who may"
    ),
    m.MAV_CMD_DO_DIGICAM_CONTROL: Meaning("Takes an image.", ardupilot="only if param5 is 1"),
    m.MAV_CMD_DO_SET_CAM_TRIGG_DIST: Meaning("Over the ground; 0 ends it."),
    m.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL: Meaning("0 or -1 ends it.", ardupilot="does not know it"),
    m.MAV_CMD_SET_CAMERA_MODE: Meaning("Images and videos in each.", ardupilot="leaves it to the camera"),
    m.MAV_CMD_IMAGE_START_CAPTURE: Meaning("0 images: until stopped; at least 0.1 s apart."),
    m.MAV_CMD_IMAGE_STOP_CAPTURE: Meaning("Ends images by time."),
    m.MAV_CMD_VIDEO_START_CAPTURE: Meaning("CAMERA_CAPTURE_STATUS tells of it."),
    m.MAV_CMD_VIDEO_STOP_CAPTURE: Meaning("CAMERA_CAPTURE_STATUS tells of it."),
    m.MAV_CMD_NAV_DELAY: Meaning("Waits.", ardupilot="also to a time of day"),
    m.MAV_CMD_DO_JUMP: Meaning(
        "-1: for ever. Counters begin anew with an upload, a start from the first item, "
        "after the mission was complete, and by DO_SET_MISSION_CURRENT's reset.",
        ardupilot="allows 15 in older versions",
    ),
    m.MAV_CMD_DO_CHANGE_SPEED: Meaning(
        "Up to DRK_HOV_VMAX the ground speed of the hover; from 7 m/s the cruise, through the air (type 0) or over "
        "the ground (1: by the wind at the start of each leg). 2 and 3: climb (take-offs too) and descent of hovered "
        "legs. Speed: -1 no change, -2 default. A throttle is refused. Holds until the mission begins anew.",
        "takes types as one, 0 or less as the default, a throttle without a speed",
        "Copter takes 0 and 1 as level; Plane 1 as the least ground speed, and a throttle",
    ),
    m.MAV_CMD_DO_VTOL_TRANSITION: Meaning(
        "3: hover the legs to come, 4: fly them forward where possible, 0: choose again. No wait of its own.",
        "ends with the transition",
        "QuadPlane 3 and 4",
    ),
}
TAKE_OFF_COMMAND = Meaning(
    "Straight up where it stands, to param7 (NaN: MIS_TAKEOFF_ALT); disarmed, it waits 20 s for arming. In the air "
    "it is refused.",
    "without a limit of time",
    "only armed and in GUIDED",
)
LAND_COMMAND = Meaning("Stops and lands there; a place is ignored.")
COMMAND_MEANINGS: dict[int, Meaning] = {
    m.MAV_CMD_NAV_TAKEOFF: TAKE_OFF_COMMAND,
    m.MAV_CMD_NAV_VTOL_TAKEOFF: TAKE_OFF_COMMAND,
    m.MAV_CMD_NAV_LAND: LAND_COMMAND,
    m.MAV_CMD_NAV_VTOL_LAND: LAND_COMMAND,
    m.MAV_CMD_NAV_RETURN_TO_LAUNCH: Meaning("As the item, in mode RTL."),
    m.MAV_CMD_NAV_LOITER_UNLIM: Meaning("Holds, upright; with a place it is refused."),
    m.MAV_CMD_DO_SET_MODE: Meaning(
        "PX4's main and sub mode. Disarmed on the ground every mode is taken; in RTL and LAND it is not armed.",
        ardupilot="has its own numbers",
    ),
    m.MAV_CMD_COMPONENT_ARM_DISARM: Meaning(
        "On the ground, if the checks pass; 21196 forces either.", ardupilot="forces arming by 2989"
    ),
    m.MAV_CMD_DO_REPOSITION: Meaning(
        "A place by COMMAND_INT, hovered or flown forward to, then held; the speed is the hover's limit. Without a "
        "place another height (round the circle if one is flown) or heading, else hold.",
        "circles there with a fixed wing, radius param3",
        "in GUIDED, or with the flag that changes the mode",
    ),
    m.MAV_CMD_DO_CHANGE_ALTITUDE: Meaning(
        "For where the vehicle is to be, or round the circle that it flies.",
        ardupilot="Plane, in GUIDED",
    ),
    m.MAV_CMD_DO_ORBIT: Meaning(
        "Flown forward for ever, not tighter than 5 m/s2; NaN: NAV_LOITER_RAD, here, at this height.",
        "orbits in the hover with any yaw",
        "does not document it",
    ),
    m.MAV_CMD_CONDITION_YAW: Meaning(
        "Turns the belly while the vehicle holds in the hover.", "by DO_REPOSITION's yaw", "Copter"
    ),
    m.MAV_CMD_MISSION_START: Meaning(
        "NaN: from the current item. 0 without param2 (0): the mission under way goes on; on the "
        "ground it begins anew if it was broken off. From item 0, or complete before, it is as after an upload.",
        "sets the item, changes the mode",
        "changes the mode to AUTO; MIS_RESTART decides whether it resumes",
    ),
    m.MAV_CMD_DO_SET_MISSION_CURRENT: Meaning(
        "The mode stays. -1: the current item. 1 resets counters, speeds and ways of flying, and lets a "
        "complete mission go on. Out of range: FAILED.",
        "has no reset",
    ),
    m.MAV_CMD_DO_PAUSE_CONTINUE: Meaning("0 holds, upright; 1 goes on with the current item."),
    m.MAV_CMD_DO_CHANGE_SPEED: Meaning(
        "As the item, for the manoeuvre under way: a hover takes no cruise speed, a cruise no hover speed.",
    ),
    m.MAV_CMD_DO_VTOL_TRANSITION: Meaning(
        "IN_PROGRESS until it hovers or flies on the wing; EXTENDED_SYS_STATE says so before the ACCEPTED. Forward "
        "outside a mission: a circle ahead.",
        "ACCEPTED at the start",
        "ACCEPTED at the start",
    ),
}
