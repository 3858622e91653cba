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
LOITER_WORDS = "In forward flight a circle with a radius (param3; without one it hovers at the place)"

ITEM_MEANINGS: dict[int, Meaning] = {
    m.MAV_CMD_NAV_WAYPOINT: Meaning(
        "param1 hold, param2 radius (0: NAV_ACC_RAD), param4 yaw where it stops. With a hold it stops; without, legs "
        "flown forward cut the corner, and fly over the point if param2 is given.",
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
COMMAND_MEANINGS: dict[int, Meaning] = {
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
