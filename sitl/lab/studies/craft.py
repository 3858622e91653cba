"""The vehicle that a study flies: an airframe, what it navigates by, and its instruments."""

from __future__ import annotations

from typing import NamedTuple

from sitl import Airframe, Navigation, Simulation, Start, Tuning, load_airframe, load_sensors
from sitl.defaults import AIRFRAME
from sitl.simulation.tuning import CONTROLLERS


class Craft(NamedTuple):
    """Names and files, which other processes read again."""

    airframe: str = AIRFRAME  # parameter set or TOML file; the design model
    navigation: Navigation = Navigation.SENSORS
    sensors: str | None = None  # TOML file; None: as shipped
    controller: str = "hybrid"  # of CONTROLLERS

    @property
    def model(self) -> Airframe:
        """The airframe as it is designed for."""
        return load_airframe(self.airframe).parameters

    @property
    def tuning(self) -> Tuning:
        """Of its controller."""
        return Tuning(controller=CONTROLLERS[self.controller])

    def fly(self, seed: int, start: Start, airframe: Airframe | None = None) -> Simulation:
        """A vehicle of this kind.

        Args:
            seed: Of gusts and instruments.
            start: Where it begins.
            airframe: As it is; the design model by default.
        """
        model = self.model
        return Simulation(
            airframe or model,
            seed=seed,
            start=start,
            tuning=self.tuning,
            design_model=model,
            navigation=self.navigation,
            sensors=load_sensors(self.sensors),
        )


DEFAULT_CRAFT = Craft()
