"""The autopilot's settings, each a parameter on the wire."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from protocol.ranges import MAX_AIRSPEED, MIN_AIRSPEED
from sitl.tools.parameter_metadata import ParameterMetadata

RETURN_HOME, RETURN_TO_LANDING, RETURN_TO_NEAREST = 0, 1, 3  # of RTL_TYPE


class Settings(NamedTuple):
    """Numbers a pilot may change in flight; SI units."""

    takeoff_altitude: Annotated[
        float, ParameterMetadata("MIS_TAKEOFF_ALT", (0.5, 500.0), "m", "Take-off height above home")
    ] = 2.5
    return_altitude: Annotated[
        float, ParameterMetadata("RTL_RETURN_ALT", (1.0, 500.0), "m", "Minimum height above home during a return")
    ] = 5.0
    return_type: Annotated[
        int,
        ParameterMetadata(
            "RTL_TYPE",
            (0, 3),
            "",
            "Where a return leads",
            ((0, "home or a rally point"), (1, "the mission's landing if it has one"), (3, "the nearest of all")),
        ),
    ] = RETURN_TO_LANDING
    climb_rate: Annotated[float, ParameterMetadata("MPC_TKO_SPEED", (0.1, 2.5), "m/s", "Climb rate of take-offs")] = 1.0
    descent_rate: Annotated[
        float, ParameterMetadata("MPC_LAND_SPEED", (0.1, 1.0), "m/s", "Descent rate of landings")
    ] = 0.5
    acceptance: Annotated[
        float, ParameterMetadata("NAV_ACC_RAD", (0.05, 50.0), "m", "Radius within which a waypoint is reached")
    ] = 0.5
    height_acceptance: Annotated[
        float,
        ParameterMetadata(
            "NAV_FW_ALT_RAD", (1.0, 100.0), "m", "How far off its height a waypoint is passed in forward flight"
        ),
    ] = 10.0
    setpoint_timeout: Annotated[
        float, ParameterMetadata("COM_OF_LOSS_T", (0.1, 60.0), "s", "Set-points older than this end OFFBOARD")
    ] = 0.5
    disarm_after: Annotated[
        float, ParameterMetadata("COM_DISARM_LAND", (0.0, 60.0), "s", "Motors stop this long after landing")
    ] = 2.0
    setpoint_action: Annotated[
        int,
        ParameterMetadata(
            "COM_OBL_RC_ACT", (3, 5), "", "When set-points stop", ((3, "return"), (4, "land"), (5, "hold"))
        ),
    ] = 5
    stick_timeout: Annotated[
        float, ParameterMetadata("COM_RC_LOSS_T", (0.1, 35.0), "s", "Sticks older than this end manual control")
    ] = 0.5
    link_timeout: Annotated[
        float, ParameterMetadata("COM_DL_LOSS_T", (1.0, 300.0), "s", "The ground station is lost after this silence")
    ] = 10.0
    link_action: Annotated[
        int,
        ParameterMetadata(
            "NAV_DLL_ACT",
            (0, 3),
            "",
            "When the ground station is lost",
            ((0, "go on"), (1, "hold"), (2, "return"), (3, "land")),
        ),
    ] = 0
    position_timeout: Annotated[
        float,
        ParameterMetadata(
            "COM_POS_FS_DELAY", (1.0, 100.0), "s", "The position counts as lost after this time without a fix"
        ),
    ] = 2.0
    pose_delay: Annotated[
        float,
        ParameterMetadata("EKF2_EV_DELAY", (0.0, 300.0), "ms", "Delay of external poses without a usable timestamp"),
    ] = 20.0
    pose_position_noise: Annotated[
        float,
        ParameterMetadata(
            "EKF2_EVP_NOISE", (0.001, 1.0), "m", "Deviation of an external position, if the message gives none"
        ),
    ] = 0.01
    pose_attitude_noise: Annotated[
        float,
        ParameterMetadata(
            "EKF2_EVA_NOISE", (0.001, 1.0), "rad", "Deviation of an external attitude, if the message gives none"
        ),
    ] = 0.01
    companion_timeout: Annotated[
        float, ParameterMetadata("COM_OBC_LOSS_T", (1.0, 60.0), "s", "The companion is lost after this silence")
    ] = 5.0
    companion_action: Annotated[
        int,
        ParameterMetadata(
            "DRK_OBC_ACT",
            (0, 3),
            "",
            "When the companion is lost",
            ((0, "go on"), (1, "hold"), (2, "return"), (3, "land")),
        ),
    ] = 0
    control_policy: Annotated[
        int,
        ParameterMetadata(
            "DRK_ONE_GCS",
            (0, 2),
            "",
            "Who may command",
            ((0, "anyone"), (1, "the station in control"), (2, "also the one that armed")),
        ),
    ] = 1
    fence_action: Annotated[
        int,
        ParameterMetadata(
            "GF_ACTION",
            (0, 5),
            "",
            "When the fence is breached",
            ((0, "off"), (1, "warn"), (2, "hold"), (3, "return"), (5, "land")),
        ),
    ] = 2
    fence_distance: Annotated[
        float, ParameterMetadata("GF_MAX_HOR_DIST", (0.0, 1e4), "m", "Fence: distance from home; 0: unlimited")
    ] = 0.0
    fence_height: Annotated[
        float, ParameterMetadata("GF_MAX_VER_DIST", (0.0, 1e4), "m", "Fence: height above home; 0: unlimited")
    ] = 0.0
    net_action: Annotated[
        int,
        ParameterMetadata(
            "DRK_NET_ACT",
            (0, 4),
            "",
            "Near the net or an obstacle",
            ((0, "off"), (1, "warn"), (2, "hold"), (3, "hold and land at the net"), (4, "hold and cut at the net")),
        ),
    ] = 4
    net_room: Annotated[
        float,
        ParameterMetadata("DRK_NET_ROOM", (0.3, 50.0), "m", "Distance to net and obstacles that a stop must leave"),
    ] = 0.5
    net_land_time: Annotated[
        float, ParameterMetadata("DRK_NET_TIME", (0.5, 60.0), "s", "Time too near the net before it lands")
    ] = 3.0
    net_cut: Annotated[
        float,
        ParameterMetadata(
            "DRK_NET_CUT", (0.0, 5.0), "m", "Distance to the net at which the motors are cut, if closing"
        ),
    ] = 0.3
    clearance: Annotated[
        float, ParameterMetadata("DRK_OBS_DIST", (0.3, 100.0), "m", "Clearance of routes and waypoints from obstacles")
    ] = 1.0
    collision_distance: Annotated[
        float,
        ParameterMetadata("CP_DIST", (-1.0, 15.0), "m", "Distance kept from live obstacles; -1: they are ignored"),
    ] = -1.0
    battery_low: Annotated[
        float, ParameterMetadata("BAT_LOW_THR", (0.0, 0.9), "", "No arming below this battery share")
    ] = 0.15
    battery_critical: Annotated[
        float, ParameterMetadata("BAT_CRIT_THR", (0.0, 0.5), "", "Battery share that must be left on arrival at home")
    ] = 0.07
    battery_action: Annotated[
        int,
        ParameterMetadata(
            "COM_LOW_BAT_ACT",
            (0, 3),
            "",
            "When the battery is low",
            ((0, "warn"), (2, "land when critical"), (3, "return in time")),
        ),
    ] = 3
    detector_action: Annotated[
        int,
        ParameterMetadata(
            "DRK_FD_ACT", (0, 1), "", "When the flight cannot be controlled", ((0, "warn"), (1, "cut the motors"))
        ),
    ] = 1
    tumble_rate: Annotated[
        float, ParameterMetadata("DRK_FD_RATE", (90.0, 2000.0), "deg/s", "Turning faster than this is tumbling")
    ] = 360.0
    tumble_time: Annotated[
        float, ParameterMetadata("DRK_FD_TIME", (0.1, 10.0), "s", "Tumbling this long counts as uncontrollable")
    ] = 2.0
    unexplained_share: Annotated[
        float, ParameterMetadata("DRK_FD_MOM", (0.2, 10.0), "", "Unexplained moment of a failed actuator, hover = 1")
    ] = 0.7
    unexplained_time: Annotated[
        float,
        ParameterMetadata("DRK_FD_MOM_T", (0.1, 10.0), "s", "Unexplained moment this long means a failed actuator"),
    ] = 1.2
    path_room: Annotated[
        float,
        ParameterMetadata("DRK_PATH_DIST", (0.0, 1000.0), "m", "Forward flight farther off its path stops; 0: any"),
    ] = 30.0
    failure_injection: Annotated[
        int, ParameterMetadata("SYS_FAILURE_EN", (0, 1), "", "Failures may be injected", ((0, "no"), (1, "yes")))
    ] = 0
    # Beyond it the hover laws lose the axis normal to the wing.
    hover_speed: Annotated[
        float, ParameterMetadata("DRK_HOV_VMAX", (0.2, 6.0), "m/s", "Horizontal speed limit of the hover laws")
    ] = 3.0
    leg_mode: Annotated[
        int,
        ParameterMetadata(
            "DRK_WAY",
            (0, 2),
            "",
            "How legs are flown",
            ((0, "the cheaper way"), (1, "hover"), (2, "forward flight where possible")),
        ),
    ] = 0
    airspeed: Annotated[
        float,
        ParameterMetadata("DRK_FWD_SPEED", (MIN_AIRSPEED, MAX_AIRSPEED), "m/s", "Cruise airspeed in forward flight"),
    ] = 15.0
    min_leg: Annotated[float, ParameterMetadata("DRK_FWD_LEG", (15.0, 1e4), "m", "Shorter legs are hovered")] = 25.0
    leg_time: Annotated[float, ParameterMetadata("DRK_LEG_TIME", (0.0, 1e4), "s", "Time limit per leg; 0: none")] = 0.0
    loiter_radius: Annotated[
        float, ParameterMetadata("NAV_LOITER_RAD", (15.0, 500.0), "m", "Default loiter radius")
    ] = 40.0
