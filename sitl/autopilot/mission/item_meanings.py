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


ITEM_WORDS = """An item whose autocontinue is 0 pauses the mission after it, until MISSION_START, DO_PAUSE_CONTINUE or
the mode goes on (PX4: until another item is chosen; ArduPilot: ignored). After a condition (unknown to PX4) the DO
items wait while the next item is flown; those still waiting at its end are passed over. Leaving the mission suspends
images. In italics: where PX4 and ArduPilot (Plane, Copter) document something else."""
COMMAND_WORDS = "Conditions but CONDITION_YAW, and DO_LAND_START, are refused: they are items alone."

TAKE_OFF_MEANING = Meaning(
    "Climbs straight up, then hovers to its place. In the air it is passed over; an interrupted climb goes on.",
    "flies to it as a waypoint in the air, ends VTOL_TAKEOFF with a front transition",
    "climbs in the air if lower",
)
LAND_MEANING = Meaning(
    "Flies to its place (0, 0: here) at its height or higher, stands upright, lands, disarms. Arm and start to go on.",
    "ignores yaw",
    "Plane lands as a plane by LAND",
)
LOITER_WORDS = "In forward flight a circle"

ITEM_MEANINGS: dict[int, Meaning] = {
    m.MAV_CMD_NAV_WAYPOINT: Meaning(
        "With a hold it stops, turned to yaw; without, forward flight passes within the radius (0: NAV_ACC_RAD), or as "
        "near as a right angle is turned, and NAV_FW_ALT_RAD of its height, after a circle if need be.",
        "flying forward ignores both",
        "Plane does not hold",
    ),
    m.MAV_CMD_NAV_LOITER_UNLIM: Meaning(f"{LOITER_WORDS} for ever; hovering, or without a radius, it hovers there."),
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
        "next item if param1 or param4 is 1; hovering, goes to its point.",
        "takes param4 for the exit's place",
        "Copter climbs at the point",
    ),
    m.MAV_CMD_DO_LAND_START: Meaning(
        "Passed over. With RTL_TYPE 1 and 3 returns fly from the nearest on.",
        "by RTL_TYPE 2 and 4 along the mission",
        "Plane by RTL_AUTOLAND, Copter by Auto RTL",
    ),
    m.MAV_CMD_CONDITION_DELAY: Meaning("The DO items after it wait that long."),
    m.MAV_CMD_CONDITION_DISTANCE: Meaning("They wait until the next item is that near, level."),
    m.MAV_CMD_CONDITION_YAW: Meaning(
        "Turns the belly (at most, and rate 0: 30 deg/s); in forward flight it is met at once."
    ),
    m.MAV_CMD_DO_SET_HOME: Meaning("Home is here (1), or at its place, unless fence, arena or mission forbid it."),
    m.MAV_CMD_DO_FENCE_ENABLE: Meaning(
        "0: no fence until disarmed, 1: that of GF_ACTION.",
        "does not know it",
        "has 2 for the floor",
    ),
    m.MAV_CMD_DO_SET_ROI_LOCATION: Meaning(
        "The camera looks there until NONE, another order to the mount, or a new start; a hovering vehicle turns its "
        "belly there (not in strong wind or landing).",
        "as a multicopter",
        "Copter turns if the mount cannot",
    ),
    m.MAV_CMD_DO_SET_ROI: Meaning(
        "With a place as DO_SET_ROI_LOCATION; without: 0 none, 1 along the way.",
        "by param1",
        "has a place, or none",
    ),
    m.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: Meaning(
        "The camera looks that far up and clockwise of the course.",
        "points it to the next waypoint",
        "does not know it",
    ),
    m.MAV_CMD_DO_SET_ROI_NONE: Meaning("The camera is fixed to the body again."),
    m.MAV_CMD_DO_MOUNT_CONFIGURE: Meaning("Accepted: nothing to configure.", ardupilot="sets the mount's mode"),
    m.MAV_CMD_DO_MOUNT_CONTROL: Meaning(
        "The camera looks up and clockwise of the heading, level (mode 2), or is fixed to the body (0, 1).",
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
        "-1: for ever. Counters begin anew with the mission, and by DO_SET_MISSION_CURRENT's reset.",
        ardupilot="allows 15 in older versions",
    ),
    m.MAV_CMD_DO_CHANGE_SPEED: Meaning(
        "Up to DRK_HOV_VMAX the hover's ground speed; from 7 m/s the cruise, through the air (type 0) or over the "
        "ground (1); 2 and 3: climb and descent of hovered legs. -1: no change, -2: default. A throttle is refused. "
        "Holds until the mission begins anew.",
        "takes types as one, 0 or less as the default, a throttle",
        "Copter takes 0 and 1 as level; Plane 1 as the least ground speed, and a throttle",
    ),
    m.MAV_CMD_DO_VTOL_TRANSITION: Meaning(
        "3: hover the legs to come, 4: fly them forward where possible, 0: choose again; no wait.",
        "ends with the transition",
        "QuadPlane 3 and 4",
    ),
}
TAKE_OFF_COMMAND = Meaning(
    "Straight up, to param7 (NaN: MIS_TAKEOFF_ALT); disarmed, it waits 20 s for arming; refused in the air.",
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
        "PX4's main and sub mode. Disarmed, every mode is taken; in RTL and LAND it is not armed.",
        ardupilot="has its own numbers",
    ),
    m.MAV_CMD_COMPONENT_ARM_DISARM: Meaning(
        "On the ground, if the checks pass; 21196 forces either.", ardupilot="forces arming by 2989"
    ),
    m.MAV_CMD_DO_REPOSITION: Meaning(
        "A place by COMMAND_INT, hovered or flown forward to, then held; the speed is the hover's. Without a place "
        "another height or heading, else hold.",
        "circles there with a fixed wing, radius param3",
        "in GUIDED, or with a flag",
    ),
    m.MAV_CMD_DO_CHANGE_ALTITUDE: Meaning(
        "For where the vehicle is to be, or its circle.",
        ardupilot="Plane, in GUIDED",
    ),
    m.MAV_CMD_DO_ORBIT: Meaning(
        "Flown forward for ever, not tighter than 5 m/s2 (40 m at 14 m/s); NaN: NAV_LOITER_RAD, here.",
        "orbits in the hover with any yaw",
        "does not document it",
    ),
    m.MAV_CMD_CONDITION_YAW: Meaning(
        "Turns the belly while the vehicle holds in the hover.", "by DO_REPOSITION's yaw", "Copter"
    ),
    m.MAV_CMD_MISSION_START: Meaning(
        "NaN: from the current item. 0 without param2 (0): goes on; on the ground a mission that was broken off begins "
        "anew. From item 0, or complete before, it is as after an upload.",
        "sets the item, changes the mode",
        "changes the mode to AUTO, resumes by MIS_RESTART",
    ),
    m.MAV_CMD_DO_SET_MISSION_CURRENT: Meaning(
        "The mode stays. -1: the current item. 1 resets counters, speeds and ways of flying.",
        "has no reset",
    ),
    m.MAV_CMD_DO_PAUSE_CONTINUE: Meaning("0 holds, upright; 1 goes on with the current item."),
    m.MAV_CMD_DO_CHANGE_SPEED: Meaning(
        "As the item, now: a hover takes no cruise speed, a cruise no hover speed.",
    ),
    m.MAV_CMD_DO_VTOL_TRANSITION: Meaning(
        "IN_PROGRESS until it hovers or flies forward (outside a mission: a circle ahead).",
        "ACCEPTED at the start",
        "ACCEPTED at the start",
    ),
}
