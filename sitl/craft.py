"""Vehicle and autopilot together, on simulated time: everything but the wire."""

from __future__ import annotations

import math

import numpy as np

from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.choice import Chooser
from sitl.autopilot.guidance import View
from sitl.autopilot.mission import World
from sitl.battery import Battery
from sitl.hybrid.supervisor import WINGED, JumpRecord, Law, Reason
from sitl.kernels import state
from sitl.kernels.quaternion import rotate
from sitl.parameters import Bindings
from sitl.vehicle import Vehicle

AUTOPILOT_TICKS = 10  # control ticks per autopilot tick: 20 ms
NOSE, BELLY = np.array((1.0, 0.0, 0.0)), np.array((0.0, 0.0, -1.0))


class Craft:
    """A vehicle under its autopilot.

    After ``advance``: read ``new_jumps()`` and the autopilot's ``notices()`` and ``reached()``.
    """

    def __init__(self, vehicle: Vehicle, world: World, bindings: Bindings, *, airborne: bool = False) -> None:
        self.vehicle = vehicle
        chooser = Chooser(vehicle.believed, can_fly_forward=vehicle.can_fly_forward)
        self.autopilot = Autopilot(world, bindings.settings, vehicle.setpoint.heading, chooser)
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
        world = bindings.world
        speed, azimuth = world.wind_speed, math.radians(world.wind_direction)
        # A wind *from* the north blows south: along -x of the world NWU; azimuth turns clockwise.
        self.vehicle.set_wind((-speed * math.cos(azimuth), speed * math.sin(azimuth), 0.0), world.gusts)

    def advance(self, ticks: int) -> None:
        """Fly; the autopilot ticks every ``AUTOPILOT_TICKS`` whatever the calls are.

        Raises:
            SitlError: If the simulation leaves the finite numbers.
        """
        while ticks > 0:
            if self.vehicle.step % AUTOPILOT_TICKS == 0:
                self._decide()
            flown = min(ticks, AUTOPILOT_TICKS - self.vehicle.step % AUTOPILOT_TICKS)
            self.vehicle.advance(flown)
            ticks -= flown

    def new_jumps(self) -> list[JumpRecord]:
        """Jumps since the last call."""
        fresh = self.vehicle.jumps[self._announced :]
        self._announced = len(self.vehicle.jumps)
        return fresh

    def view(self) -> View:
        """The vehicle as the autopilot sees it."""
        x = self.vehicle.plant
        q = x[state.Q : state.Q + 4].copy()  # rotate is compiled for whole arrays
        nose, belly = rotate(q, NOSE), rotate(q, BELLY)
        forward = self.vehicle.law in WINGED and not self.vehicle.stands
        flat = belly if abs(nose[2]) > math.hypot(nose[0], nose[1]) else nose
        return View(
            time=self.vehicle.time,
            p=(float(x[0]), float(x[1]), float(x[2])),
            v=(float(x[3]), float(x[4]), float(x[5])),
            heading=math.atan2(flat[1], flat[0]),
            tilt=math.acos(max(-1.0, min(1.0, float(nose[2])))),
            landed=self.vehicle.law is Law.LANDED,
            energy_left=self.battery.left,
            forward=forward,
            wind=tuple(self.vehicle.wind_estimate.tolist()),
            stopping=self.vehicle.stopping_distance() if forward else 0.0,
            energy=self.battery.capacity - self.battery.used,
            law=self.vehicle.law,
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
        self.vehicle.set_target(self.autopilot.update(self.view()))
        self.vehicle.armed = self.autopilot.armed
        self.vehicle.flying = self.autopilot.flying
        self.vehicle.landing = self.autopilot.landing

    def _begin_hovering(self) -> None:
        self.autopilot.armed = self.autopilot.flying = True
        self.vehicle.begin_flight(Law.HOVER_LINEAR)
        self.autopilot.setpoint = self.vehicle.setpoint
        self.autopilot.update(self.view())
        self.autopilot.hold()
