"""The vehicle's parameters: their table, and the configuration that they set.

Names follow PX4 where PX4 has the parameter, so that stock clients find them; DRK_ are the hybrid controller's own,
SIM_ belong to the simulated world. Names, bounds and texts stand on the fields that the parameters set.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import Annotated, NamedTuple, TypeVar, get_type_hints

from protocol.dialect import mavlink
from protocol.engines.table_values import Parameter
from sitl.autopilot.settings import Settings
from sitl.errors import SitlError
from sitl.model.ground import GroundPlane, ground_plane
from sitl.model.vectors import Vector
from sitl.simulation.tuning import Tuning
from sitl.tools.parameter_metadata import ParameterMetadata, annotated_fields

REAL = mavlink.MAV_PARAM_TYPE_REAL32
INT = mavlink.MAV_PARAM_TYPE_INT32
TERMINATE = 4  # of PX4's GF_ACTION

Group = TypeVar("Group", Settings, Tuning, "WorldSettings")


class WorldSettings(NamedTuple):
    """The simulated world: its wind and its ground, the arena's wind wall, and the battery on board."""

    wind_speed: Annotated[float, ParameterMetadata("SIM_WIND_SPD", (0.0, 30.0), "m/s", "Steady wind")] = 0.0
    wind_direction: Annotated[
        float,
        ParameterMetadata("SIM_WIND_DIR", (-360.0, 360.0), "deg", "Where the wind comes from, clockwise from north"),
    ] = 0.0
    gusts: Annotated[float, ParameterMetadata("SIM_GUST_RMS", (0.0, 10.0), "m/s", "Gusts, rms per axis")] = 0.0
    battery: Annotated[float, ParameterMetadata("SIM_BAT_ENERGY", (100.0, 1e7), "J", "Energy of a full battery")] = (
        100e3
    )
    link_off_time: Annotated[
        float, ParameterMetadata("SIM_LINK_OFF_T", (1.0, 3600.0), "s", "Duration of an injected link failure")
    ] = 15.0
    failure_wrong: Annotated[
        int,
        ParameterMetadata(
            "SIM_FAIL_WRONG",
            (0, 2),
            "",
            "How an instrument reads wrong that fails so from now on",
            ((0, "by an offset"), (1, "by a share"), (2, "ever more")),
        ),
    ] = 0
    failure_size: Annotated[
        float, ParameterMetadata("SIM_FAIL_SIZE", (-10.0, 10.0), "", "How wrong it then reads, usual = 1")
    ] = 1.0
    motion_capture: Annotated[
        int,
        ParameterMetadata(
            "SIM_MOCAP", (0, 1), "", "Simulated motion capture", ((0, "off: only poses from peers"), (1, "on"))
        ),
    ] = 1
    wall_speed: Annotated[
        float,
        ParameterMetadata(
            "SIM_WALL_SPD", (-1.0, 30.0), "m/s", "Wind wall of the arena: its speed; -1: by its schedule"
        ),
    ] = -1.0
    wall_turbulence: Annotated[
        float,
        ParameterMetadata("SIM_WALL_TURB", (-1.0, 1.0), "", "Wind wall: intensity of its turbulence; -1: the arena's"),
    ] = -1.0
    wall_gust: Annotated[
        float,
        ParameterMetadata(
            "SIM_WALL_GUST", (0.0, 30.0), "m/s", "Wind wall: amplitude of a 1-cos gust, which begins when this is set"
        ),
    ] = 0.0
    wall_gust_time: Annotated[
        float, ParameterMetadata("SIM_WALL_GTIME", (0.1, 60.0), "s", "Wind wall: duration of such a gust")
    ] = 2.0
    turbulence_wind: Annotated[
        float,
        ParameterMetadata("SIM_TURB_W20", (0.0, 30.0), "m/s", "Dryden turbulence, by the wind at 20 ft; 0: none"),
    ] = 0.0
    ground_height: Annotated[
        float, ParameterMetadata("SIM_GND_ALT", (-500.0, 500.0), "m", "Ground: its height at the origin, above that")
    ] = 0.0
    ground_slope: Annotated[
        float, ParameterMetadata("SIM_GND_SLOPE", (0.0, 30.0), "deg", "Ground: its slope; 0: level")
    ] = 0.0
    ground_rises_to: Annotated[
        float, ParameterMetadata("SIM_GND_DIR", (-360.0, 360.0), "deg", "Ground: where it rises, clockwise from north")
    ] = 0.0

    @property
    def wind(self) -> Vector:
        """Velocity of the air, world NWU [m/s]: a wind *from* the north blows south; its direction turns clockwise."""
        azimuth = math.radians(self.wind_direction)
        return Vector(-self.wind_speed * math.cos(azimuth), self.wind_speed * math.sin(azimuth), 0.0)

    @property
    def ground(self) -> GroundPlane:
        """The ground as a plane."""
        return ground_plane(self.ground_height, math.radians(self.ground_slope), math.radians(self.ground_rises_to))

    def on_the_ground_of(self, other: WorldSettings) -> WorldSettings:
        """The same on another's ground."""
        return self._replace(
            ground_height=other.ground_height, ground_slope=other.ground_slope, ground_rises_to=other.ground_rises_to
        )


class Configuration(NamedTuple):
    """All that parameters set."""

    settings: Settings = Settings()
    tuning: Tuning = Tuning()
    world: WorldSettings = WorldSettings()

    def value(self, name: str) -> float:
        """The value of a parameter."""
        return PARAMETERS[name].value_in(self)

    def replaced(self, values: Mapping[str, float]) -> Configuration:
        """The same with some parameters changed.

        Raises:
            SitlError: If a name is unknown, a value is out of its bounds, or the values do not fit together.
        """
        changed = self
        for name, value in values.items():
            if name not in PARAMETERS:
                raise SitlError(_unknown_parameter(name))
            changed = PARAMETERS[name].replaced_in(changed, value)
        changed.check_together()
        return changed

    def with_parameter(self, parameter: Parameter) -> Configuration:
        """The same with a parameter of the wire's table, whose value is within its bounds.

        Raises:
            SitlError: If it does not fit the others.
        """
        changed = PARAMETERS[parameter.name].set_in(self, parameter.value)
        changed.check_together()
        return changed

    def check_together(self) -> None:
        """Raise SitlError if the values do not fit together."""
        enter, leave = self.tuning.v_enter, self.tuning.v_leave
        if enter >= 0.0 and leave >= 0.0 and enter >= leave:
            raise SitlError("DRK_V_ENTER must stay below DRK_V_LEAVE: the hysteresis needs its gap")
        if self.tuning.v_forward_enter >= self.tuning.v_forward_leave:
            raise SitlError("DRK_VF_ENTER must stay below DRK_VF_LEAVE: the hysteresis needs its gap")
        if self.settings.fence_action == TERMINATE:
            raise SitlError("GF_ACTION 4 (terminate) is not available: a tail-sitter without motors falls")

    def wire_table(self) -> list[Parameter]:
        """The parameters as the parameter service lists them."""
        return [bound.on_the_wire(self) for bound in PARAMETERS.values()]


class BoundParameter(NamedTuple):
    """A parameter, and the field of the configuration that it sets."""

    metadata: ParameterMetadata
    group: str
    field: str
    is_integer: bool

    def value_in(self, configuration: Configuration) -> float:
        """Its value."""
        return float(getattr(getattr(configuration, self.group), self.field))

    def replaced_in(self, configuration: Configuration, value: float) -> Configuration:
        """The configuration with this parameter changed.

        Raises:
            SitlError: If the value is out of its bounds.
        """
        if flaw := self.on_the_wire(configuration).flaw(value):
            raise SitlError(f"{self.metadata.name} = {flaw}")
        return self.set_in(configuration, value)

    def set_in(self, configuration: Configuration, value: float) -> Configuration:
        """The configuration with this parameter at a value within its bounds."""
        group = getattr(configuration, self.group)
        changed = group._replace(**{self.field: int(value) if self.is_integer else value})
        return configuration._replace(**{self.group: changed})

    def on_the_wire(self, configuration: Configuration) -> Parameter:
        """Its row of the parameter service's table."""
        minimum, maximum = self.metadata.bounds
        return Parameter(
            name=self.metadata.name,
            type=INT if self.is_integer else REAL,
            value=self.value_in(configuration),
            minimum=minimum,
            maximum=maximum,
            unit=self.metadata.unit,
            description=self.metadata.meaning,
        )


def _unknown_parameter(name: str) -> str:
    near = get_close_matches(name, PARAMETERS, n=1)
    return f"there is no parameter {name}" + (f"; did you mean {near[0]}?" if near else " (docs/wire.md lists them)")


def _bound_parameters() -> Iterator[tuple[str, BoundParameter]]:
    for group, group_type in get_type_hints(Configuration).items():
        for field in annotated_fields(group_type):
            yield field.metadata.name, BoundParameter(field.metadata, group, field.name, field.type is int)


PARAMETERS = dict(_bound_parameters())
"""All parameters by name, in their order on the wire."""


def within_bounds(group: Group) -> Group:
    """A group of the configuration with each value moved to the nearest one that its parameter can have."""
    clipped = {}
    for field in annotated_fields(type(group)):
        minimum, maximum = field.metadata.bounds
        clipped[field.name] = min(max(getattr(group, field.name), minimum), maximum)
    return group._replace(**clipped)
