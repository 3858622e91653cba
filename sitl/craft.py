"""Vehicle and autopilot together, on simulated time: everything but the wire."""

from __future__ import annotations

import math

from protocol.dialect.vocabulary import Law, Reason, Regime
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.guidance import View
from sitl.autopilot.mission import World
from sitl.battery import Battery
from sitl.model.quaternions import x_axis, z_axis
from sitl.parameters import Bindings
from sitl.prediction.chooser import Chooser
from sitl.simulation.recording import JumpRecord
from sitl.simulation.simulation import Simulation

AUTOPILOT_PERIODS = 10  # control periods per autopilot tick: 20 ms
HOVERING = frozenset({Regime.GROUND, Regime.UPRIGHT})


def is_forward(law: Law) -> bool:
    """Whether a law flies forward, or on the way there or back."""
    return law.regime not in HOVERING


class Craft:
    """A vehicle under its autopilot.

    After ``advance``: read ``new_jumps()`` and the autopilot's ``notices()`` and ``reached()``.
    """

    def __init__(self, vehicle: Simulation, world: World, bindings: Bindings, *, airborne: bool = False) -> None:
        self.vehicle = vehicle
        self._chooser = Chooser(vehicle.design_model, bindings.tuning, can_fly_forward=vehicle.can_fly_forward)
        self.autopilot = Autopilot(world, bindings.settings, vehicle.reference.heading, self._chooser)
        self.bind(bindings)
        self._announced = self._seen = 0  # jumps told to the wire, and to the autopilot
        if airborne:
            self._begin_hovering()
        self.autopilot.update(self.view())

    def bind(self, bindings: Bindings) -> None:
        """Take changed parameters, in flight or not."""
        self.bindings = bindings
        self.autopilot.apply(bindings.settings)
        if bindings.tuning != self.vehicle.tuning:
            self.vehicle.retune(bindings.tuning)
        self._chooser.tuning = bindings.tuning
        world = bindings.world
        speed, azimuth = world.wind_speed, math.radians(world.wind_direction)
        # A wind *from* the north blows south: along -x of the world NWU; azimuth turns clockwise.
        self.vehicle.set_wind((-speed * math.cos(azimuth), speed * math.sin(azimuth), 0.0), world.gusts)

    def advance(self, periods: int) -> None:
        """Fly for control periods; the autopilot ticks every ``AUTOPILOT_PERIODS`` whatever the calls are.

        Raises:
            SitlError: If the simulation leaves the finite numbers.
        """
        while periods > 0:
            if self.vehicle.periods % AUTOPILOT_PERIODS == 0:
                self._decide()
            flown = min(periods, AUTOPILOT_PERIODS - self.vehicle.periods % AUTOPILOT_PERIODS)
            self.vehicle.advance(flown)
            periods -= flown

    def new_jumps(self) -> list[JumpRecord]:
        """Jumps since the last call."""
        fresh = self.vehicle.jumps[self._announced :]
        self._announced = len(self.vehicle.jumps)
        return fresh

    def view(self) -> View:
        """The vehicle as the autopilot sees it."""
        estimate, law = self.vehicle.estimate, self.vehicle.law
        nose, back = x_axis(estimate.attitude), z_axis(estimate.attitude)
        forward = is_forward(law) and not self.vehicle.stands
        flat = (-back.x, -back.y) if abs(nose.z) > math.hypot(nose.x, nose.y) else (nose.x, nose.y)
        return View(
            time=self.vehicle.time,
            p=estimate.position,
            v=estimate.velocity,
            heading=math.atan2(flat[1], flat[0]),
            tilt=math.acos(max(-1.0, min(1.0, nose.z))),
            landed=law is Law.LANDED,
            energy_left=self.battery.left,
            forward=forward,
            wind=estimate.wind,
            stopping=self.vehicle.stopping_distance() if forward else 0.0,
            energy=self.battery.capacity - self.battery.used,
            law=law,
        )

    @property
    def battery(self) -> Battery:
        """What is left to fly with."""
        return Battery(self.bindings.world.battery, self.vehicle.energy)

    def _decide(self) -> None:
        fresh = self.vehicle.jumps[self._seen :]
        self._seen += len(fresh)
        if any(jump.reason is Reason.TOUCHDOWN for jump in fresh):
            self.autopilot.touched_down()
        self.vehicle.reference = self.autopilot.update(self.view())
        self.vehicle.armed = self.autopilot.armed
        self.vehicle.flying = self.autopilot.flying
        self.vehicle.landing = self.autopilot.landing

    def _begin_hovering(self) -> None:
        self.autopilot.armed = self.autopilot.flying = True
        self.vehicle.begin_flight(Law.HOVER_LINEAR)
        self.autopilot.reference = self.vehicle.reference
        self.autopilot.update(self.view())
        self.autopilot.hold()
