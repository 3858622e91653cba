"""The vehicle's parameters on the wire, and what each of them sets.

Names follow PX4 where PX4 has the parameter, so that stock clients find them; DRK_ are the hybrid
controller's own, SIM_ belong to the simulated world.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.engines.parameters import Parameter
from sitl.autopilot.settings import Settings
from sitl.errors import SitlError
from sitl.simulation.tuning import Tuning

REAL = mavlink.MAV_PARAM_TYPE_REAL32
INT = mavlink.MAV_PARAM_TYPE_INT32
TERMINATE = 4  # of PX4's GF_ACTION


class Surroundings(NamedTuple):
    """The simulated surroundings as parameters set them."""

    wind_speed: float = 0.0  # [m/s]
    wind_direction: float = 0.0  # where it comes from, clockwise from north [deg]
    gusts: float = 0.0  # rms per axis [m/s]
    battery: float = 100e3  # shaft energy of a full battery [J]


class Entry(NamedTuple):
    """One parameter: its bounds, and the field of Settings, Tuning or Surroundings it sets."""

    name: str
    group: str
    field: str
    minimum: float
    maximum: float
    unit: str
    description: str
    integer: bool = False


TABLE = (
    Entry("MIS_TAKEOFF_ALT", "settings", "takeoff_altitude", 0.5, 500.0, "m", "Take-off height above home"),
    Entry("RTL_RETURN_ALT", "settings", "return_altitude", 1.0, 500.0, "m", "Minimum height on the way home"),
    Entry("MPC_TKO_SPEED", "settings", "climb_rate", 0.1, 2.5, "m/s", "Climb rate of take-offs"),
    Entry("MPC_LAND_SPEED", "settings", "descent_rate", 0.1, 1.0, "m/s", "Descent rate of landings"),
    Entry("NAV_ACC_RAD", "settings", "acceptance", 0.05, 50.0, "m", "Radius within which a waypoint is reached"),
    Entry(
        "COM_OF_LOSS_T",
        "settings",
        "setpoint_timeout",
        0.1,
        60.0,
        "s",
        "Set-points older than this end OFFBOARD",
    ),
    Entry("COM_DISARM_LAND", "settings", "disarm_after", 0.0, 60.0, "s", "Motors stop this long after landing"),
    Entry("COM_OBL_RC_ACT", "settings", "setpoint_action", 3, 5, "", "Set-points stop: 3 return, 4 land, 5 hold", True),
    Entry("COM_RC_LOSS_T", "settings", "stick_timeout", 0.1, 35.0, "s", "Sticks older than this end manual control"),
    Entry("COM_DL_LOSS_T", "settings", "link_timeout", 1.0, 300.0, "s", "The ground station is lost after this"),
    Entry("NAV_DLL_ACT", "settings", "link_action", 0, 3, "", "No ground: 0 go on, 1 hold, 2 return, 3 land", True),
    Entry("COM_OBC_LOSS_T", "settings", "companion_timeout", 1.0, 60.0, "s", "The companion is lost after this"),
    Entry("DRK_OBC_ACT", "settings", "companion_action", 0, 3, "", "No companion: as NAV_DLL_ACT", True),
    Entry("DRK_ONE_GCS", "settings", "one_operator", 0, 2, "", "Control: 0 anyone, 1 who asked, 2 or who armed", True),
    Entry("GF_ACTION", "settings", "fence_action", 0, 5, "", "Fence: 0 off, 1 warn, 2 hold, 3 return, 5 land", True),
    Entry("GF_MAX_HOR_DIST", "settings", "fence_reach", 0.0, 1e4, "m", "Fence: distance from home; 0: unlimited"),
    Entry("GF_MAX_VER_DIST", "settings", "fence_ceiling", 0.0, 1e4, "m", "Fence: height above home; 0: unlimited"),
    Entry("BAT_LOW_THR", "settings", "battery_low", 0.0, 0.9, "", "No arming below this share of the battery"),
    Entry("BAT_CRIT_THR", "settings", "battery_critical", 0.0, 0.5, "", "Share of the battery to be home with"),
    Entry("COM_LOW_BAT_ACT", "settings", "battery_action", 0, 3, "", "Battery: 0 warn, 2 land, 3 return in time", True),
    Entry("DRK_HOV_VMAX", "settings", "hover_speed", 0.2, 6.0, "m/s", "Horizontal speed limit of the hover laws"),
    Entry("DRK_WAY", "settings", "way", 0, 2, "", "Legs: 0 the better way, 1 hover, 2 forward", True),
    Entry("DRK_FWD_SPEED", "settings", "airspeed", 7.0, 22.0, "m/s", "Cruise airspeed in forward flight"),
    Entry("DRK_FWD_LEG", "settings", "min_leg", 15.0, 1e4, "m", "Legs shorter than this are hovered"),
    Entry("DRK_LEG_TIME", "settings", "leg_time", 0.0, 1e4, "s", "Time limit per leg; 0: none"),
    Entry("NAV_LOITER_RAD", "settings", "loiter_radius", 15.0, 500.0, "m", "Default loiter radius"),
    Entry("DRK_V_ENTER", "tuning", "v_enter", 0.1, 1e5, "", "V below which the linear hover law takes over"),
    Entry("DRK_V_LEAVE", "tuning", "v_leave", 0.1, 1e5, "", "V above which the linear hover law hands over"),
    Entry("DRK_LQI", "tuning", "integral", 0, 1, "", "Integral of the position error in the linear law", True),
    Entry("DRK_GOVERNOR", "tuning", "governor", 0, 4, "", "Saturation of the zero-moment law", True),
    Entry("DRK_NU_PRIME", "tuning", "nu_prime", 0, 1, "", "Use nu' of appendix D instead of nu", True),
    Entry("DRK_KPP", "tuning", "kpp", 0.1, 3.0, "N/m", "Position gain of the zero-moment law"),
    Entry("DRK_KPD", "tuning", "kpd", 0.1, 3.0, "N s/m", "Velocity gain of the zero-moment law"),
    Entry("DRK_KDELTA", "tuning", "k_delta", 0.5, 20.0, "1/s", "Force convergence of the zero-moment law"),
    Entry("DRK_LAMBDA", "tuning", "lam", 1.0, 20.0, "rad/s", "Attitude bandwidth of the zero-moment law"),
    Entry("DRK_ZETA", "tuning", "zeta", 0.2, 2.0, "", "Attitude damping ratio of the zero-moment law"),
    Entry("DRK_KQ", "tuning", "k_q", 0.0, 5.0, "rad/s", "Heading gain of the zero-moment law"),
    Entry("DRK_LIN_DESIGN", "tuning", "design", 0, 1, "", "Gain of the linear hover law: 0 LQR or LQI, 1 LMI", True),
    Entry("DRK_FWD_LIN", "tuning", "forward_linear", 0, 1, "", "Hand straight legs to the linear forward law", True),
    Entry("DRK_VF_ENTER", "tuning", "v_forward_enter", 0.0, 1e5, "", "V below which the linear forward law takes over"),
    Entry("DRK_VF_LEAVE", "tuning", "v_forward_leave", 0.0, 1e5, "", "V above which the linear forward law hands back"),
    Entry("DRK_PITOT", "tuning", "pitot", 0, 1, "", "The wind estimator has a pitot tube", True),
    Entry("SIM_WIND_SPD", "world", "wind_speed", 0.0, 30.0, "m/s", "Steady wind"),
    Entry("SIM_WIND_DIR", "world", "wind_direction", -360.0, 360.0, "deg", "Where the wind comes from"),
    Entry("SIM_GUST_RMS", "world", "gusts", 0.0, 10.0, "m/s", "Gusts, rms per axis"),
    Entry("SIM_BAT_ENERGY", "world", "battery", 100.0, 1e7, "J", "Shaft energy of a full battery"),
)
BY_NAME = {entry.name: entry for entry in TABLE}


class Bindings(NamedTuple):
    """The three groups of numbers that parameters set."""

    settings: Settings
    tuning: Tuning
    world: Surroundings

    def value(self, name: str) -> float:
        """The value of a parameter."""
        entry = BY_NAME[name]
        return float(getattr(getattr(self, entry.group), entry.field))

    def replaced(self, values: Mapping[str, float]) -> Bindings:
        """The same with some parameters changed.

        Raises:
            SitlError: If a name is unknown, a value is out of its bounds, or the values do not fit together.
        """
        groups = self._asdict()
        for name, value in values.items():
            entry = BY_NAME.get(name)
            if entry is None:
                raise SitlError(f"no parameter {name}: there are {', '.join(BY_NAME)}")
            if not entry.minimum <= value <= entry.maximum:
                raise SitlError(f"{name} = {value:g} is not within {entry.minimum:g} and {entry.maximum:g}")
            kept = int(value) if entry.integer else value
            groups[entry.group] = groups[entry.group]._replace(**{entry.field: kept})
        if groups["tuning"].v_enter >= groups["tuning"].v_leave:
            raise SitlError("DRK_V_ENTER must stay below DRK_V_LEAVE: the hysteresis needs its gap")
        if groups["tuning"].v_forward_enter >= groups["tuning"].v_forward_leave:
            raise SitlError("DRK_VF_ENTER must stay below DRK_VF_LEAVE: the hysteresis needs its gap")
        if groups["settings"].fence_action == TERMINATE:
            raise SitlError("GF_ACTION 4 (terminate) is not available: a tail-sitter without motors falls")
        return Bindings(**groups)

    def wire_table(self) -> list[Parameter]:
        """The parameters as the parameter service lists them."""
        return [
            Parameter(
                name=entry.name,
                type=INT if entry.integer else REAL,
                value=self.value(entry.name),
                minimum=entry.minimum,
                maximum=entry.maximum,
                unit=entry.unit,
                description=entry.description,
            )
            for entry in TABLE
        ]
