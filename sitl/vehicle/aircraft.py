"""Vehicle and autopilot together, on simulated time; they know no MAVLink message and no socket."""

from __future__ import annotations

import math

from protocol.dialect.vocabulary import Law, Reason, Regime
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.world import World
from sitl.enclosure.arena_detours import prepare_detours
from sitl.errors import SitlError
from sitl.guidance.view import VehicleView
from sitl.model.airframe import BATTERY
from sitl.model.battery import Battery
from sitl.model.ground import GroundPlane, is_clear
from sitl.model.quaternions import x_axis, z_axis
from sitl.prediction.chooser import Chooser
from sitl.sensors.instruments import ACCELEROMETER, GYROSCOPE
from sitl.simulation.navigation_status import NavigationStatus, navigation_status
from sitl.simulation.recording import JumpRecord
from sitl.simulation.simulation import Simulation
from sitl.simulation.situation import hovers_again, regime, stopping_distance
from sitl.simulation.tuning import REPORTED, Tuning
from sitl.tools.error_guard import ErrorGuard
from sitl.vehicle.actuator_watch import ActuatorWatch, UnexplainedMoment
from sitl.vehicle.injected_failures import WAYS_TO_BE_WRONG, InjectedFailures
from sitl.vehicle.parameters import Configuration, WorldSettings

AUTOPILOT_PERIODS = 10  # control periods per autopilot tick: 20 ms
NAVIGATION_PERIODS = 50  # control periods after which the autopilot looks at navigation again: that costs time
# After a crash nothing that was believed before counts. The filter stands up to 0.16 s in the past: it meets the impact
# only then [s].
IMPACT_TIME = 0.5
HOVERING = frozenset({Regime.GROUND, Regime.UPRIGHT})


def is_forward(vehicle: Simulation) -> bool:
    """Whether a vehicle is in forward flight or in a transition."""
    return regime(vehicle) not in HOVERING


class Aircraft:
    """A vehicle under its autopilot.

    After ``advance``: read ``new_jumps()`` and the autopilot's ``notices()`` and ``reached()``. An error in the
    autopilot is raised, unless ``guard`` has somebody who reports it: then the vehicle holds.

    Args:
        vehicle: What flies.
        world: Where it flies.
        configuration: What parameters set.
        airborne: Begin in the air, holding; else on the ground, disarmed.
    """

    def __init__(
        self, vehicle: Simulation, world: World, configuration: Configuration, *, airborne: bool = False
    ) -> None:
        self.vehicle, self.guard = vehicle, ErrorGuard()
        self.configuration = Configuration()
        vehicle.surroundings.enclose(world.arena)
        prepare_detours(world.arena)
        self.failures = InjectedFailures(vehicle)
        self._actuator_watch, self._unexplained = ActuatorWatch(vehicle.design_model), UnexplainedMoment()
        self._is_numb = False  # the accelerometer has failed
        self._seen_navigation, self._seen_at = self.navigation, vehicle.periods
        self._chooser = Chooser(vehicle.design_model, configuration.tuning, can_fly_forward=vehicle.can_fly_forward)
        self.autopilot = Autopilot(world, configuration.settings, vehicle.reference.heading, self._chooser)
        self.configure(configuration)
        self._reported = self._seen = 0  # jumps that new_jumps() gave, and that the autopilot knows
        self._way_of_flying = regime(vehicle)
        if airborne:
            self._begin_hovering()
        self.autopilot.update(self.view())

    def configure(self, configuration: Configuration) -> None:
        """Put changed parameters in force, in flight or not.

        Raises:
            SitlError: If no controller can be designed for them, or the ground would move under a standing vehicle
                or into a flying one; nothing is changed then.
        """
        self._lay_ground(configuration.world.ground)
        self._tune(configuration.tuning)
        before, self.configuration = self.configuration.world, configuration
        self.autopilot.configure(configuration.settings)
        self._chooser.tuning = configuration.tuning
        world = configuration.world
        self.vehicle.set_wind(world.wind, world.gusts)
        self._set_wind(before, world)
        self.failures.wrong, self.failures.size = WAYS_TO_BE_WRONG[world.failure_wrong], world.failure_size
        self.vehicle.avionics.switch_motion_capture(on=bool(world.motion_capture))
        self._seen_navigation, self._seen_at = self.navigation, self.vehicle.periods

    def _lay_ground(self, ground: GroundPlane) -> None:
        """Have the ground elsewhere: a vehicle that stands and has not moved yet is put on it."""
        vehicle, around = self.vehicle, self.vehicle.surroundings
        body, is_new = vehicle.truth.body, vehicle.periods == 0
        if ground == around.ground:
            return
        if not is_new and not is_clear(body, around.ground):
            raise SitlError("the vehicle is on the ground: that is moved before its first flight, or while it flies")
        stays = is_new and not vehicle.start.airborne
        if not stays and not is_clear(body, ground):
            raise SitlError("the ground would come to where the vehicle is")
        around.ground = ground
        if stays:
            vehicle.begin(vehicle.start)

    def _set_wind(self, before: WorldSettings, now: WorldSettings) -> None:
        """Have the wind wall blow as changed settings say."""
        around, wall = self.vehicle.surroundings, self.autopilot.world.arena.wall
        around.set_open_air(now.turbulence_wind)
        if wall is None:
            return
        if now.wall_speed != before.wall_speed:
            around.put_wall(wall) if now.wall_speed < 0.0 else around.set_speed(now.wall_speed)
        around.set_intensity(wall.intensity if now.wall_turbulence < 0.0 else now.wall_turbulence)
        if now.wall_gust > 0.0 and now.wall_gust != before.wall_gust:
            around.begin_burst(self.vehicle.time, now.wall_gust_time, now.wall_gust)

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

    def warm_up(self) -> None:
        """Compile what flies and what decides, or read it from disk; nothing moves."""
        self.vehicle.warm_up()
        self._actuator_watch.look(self.vehicle.estimate_record, self.vehicle.time)
        self._actuator_watch.stand()
        stopping_distance(self.vehicle)

    def new_jumps(self) -> list[JumpRecord]:
        """Jumps since the last call."""
        fresh = self.vehicle.jumps[self._reported :]
        self._reported = len(self.vehicle.jumps)
        return fresh

    @property
    def navigation(self) -> NavigationStatus:
        """State of the vehicle's own navigation."""
        return navigation_status(self.vehicle.avionics, self.vehicle.periods)

    def _recent_navigation(self) -> NavigationStatus:
        """Navigation as it was at most NAVIGATION_PERIODS ago."""
        if self.vehicle.periods - self._seen_at >= NAVIGATION_PERIODS:
            self._seen_navigation, self._seen_at = self.navigation, self.vehicle.periods
        return self._seen_navigation

    @property
    def way_of_flying(self) -> Regime:
        """Hover, forward flight or a transition, as it is told to others.

        A back transition ends when the vehicle hovers, although its law may stay in force until a wind drops; and a
        vehicle that hovers makes none, although the law of back transitions may stop its sliding.
        """
        return self._way_of_flying

    def _follow_way_of_flying(self) -> None:
        flown, hovered = regime(self.vehicle), self._way_of_flying in HOVERING
        stays = flown is Regime.BACK_TRANSITION and (hovered or hovers_again(self.vehicle))
        self._way_of_flying = Regime.UPRIGHT if stays else flown

    def view(self) -> VehicleView:
        """The vehicle as the autopilot sees it."""
        estimate, law, avionics = self.vehicle.estimate, self.vehicle.law, self.vehicle.avionics
        navigation, battery = self._recent_navigation(), self.battery
        nose, back = x_axis(estimate.attitude), z_axis(estimate.attitude)
        flown = regime(self.vehicle)
        forward = flown not in HOVERING and not hovers_again(self.vehicle)
        flat = (-back.x, -back.y) if abs(nose.z) > math.hypot(nose.x, nose.y) else (nose.x, nose.y)
        return VehicleView(
            time=self.vehicle.time,
            p=estimate.position,
            v=estimate.velocity,
            heading=math.atan2(flat[1], flat[0]),
            tilt=math.acos(max(-1.0, min(1.0, nose.z))),
            landed=law.regime is Regime.GROUND,
            battery_remaining=battery.remaining,
            forward=forward,
            wind=estimate.wind,
            stopping_distance=stopping_distance(self.vehicle) if forward else 0.0,
            battery_energy=battery.capacity - battery.used,
            law=law,
            regime=flown,
            crash=self.vehicle.crash,
            touched=self.vehicle.surroundings.touched,
            rates=estimate.rates,
            gyroscope_failed=avionics.has_failed(GYROSCOPE),
            accelerometer_failed=avionics.has_failed(ACCELEROMETER),
            aligned=navigation.is_aligned,
            awaited=navigation.awaited,
            position_age=navigation.position_age,
            height_deviation=navigation.position_deviation.z,
            failed_motors=self.failures.failed_motors,
            unfused=navigation.unfused,
            unexplained=(self._unexplained.roll, self._unexplained.yaw),
            shaking=self._unexplained.shaking,
            attitude=estimate.attitude,
            resets=navigation.resets,
        )

    @property
    def battery(self) -> Battery:
        """The battery as it is now."""
        a = self.vehicle.airframe
        resistance = a.battery_resistance if a.energy_account == BATTERY else 0.0
        return self.failures.read(Battery(self.configuration.world.battery, self.vehicle.energy, resistance))

    def _decide(self) -> None:
        """Have the autopilot tick; after an error in it, it holds."""
        decided = False
        with self.guard:
            self._tick()
            decided = True
        if not decided:
            with self.guard:
                self.vehicle.reference = self.autopilot.recover()
        self.vehicle.armed = self.autopilot.armed
        self.vehicle.flying = self.autopilot.flying
        self.vehicle.landing = self.autopilot.landing

    def _tick(self) -> None:
        self._watch_actuators()
        self._fall_back()
        fresh = self.vehicle.jumps[self._seen :]
        self._seen += len(fresh)
        self._follow_way_of_flying()
        view = self.view()
        if self.vehicle.law is Law.CRASHED and self.vehicle.law_time < IMPACT_TIME:
            self.vehicle.avionics.doubt_motion()
        if any(jump.target is Law.CRASHED for jump in fresh):
            self.autopilot.crashed(view)
        elif any(jump.reason is Reason.TOUCHDOWN for jump in fresh):
            self.autopilot.touched_down(view)
        reference = self.autopilot.update(view)
        if not all(map(math.isfinite, (*reference.position, reference.heading, reference.speed))):
            raise ArithmeticError(f"the reference is not finite: {reference}")
        self.vehicle.reference = reference

    def _watch_actuators(self) -> None:
        on_ground, watch = self.vehicle.law.regime is Regime.GROUND, self._actuator_watch
        self._unexplained = watch.stand() if on_ground else watch.look(self.vehicle.estimate_record, self.vehicle.time)

    def _fall_back(self) -> None:
        """Have the laws that need no accelerometer fly where it has failed: INDI measures with it."""
        is_numb = self.vehicle.avionics.has_failed(ACCELEROMETER)
        if is_numb != self._is_numb:
            self._is_numb = is_numb
            self._tune(self.configuration.tuning)

    def _tune(self, tuning: Tuning) -> None:
        tuning = tuning._replace(controller=REPORTED) if self._is_numb else tuning
        if tuning != self.vehicle.tuning:
            self.vehicle.retune(tuning)

    def _begin_hovering(self) -> None:
        self.vehicle.begin_flight(Law.HOVER_LINEAR)
        self.autopilot.begin_hovering(self.vehicle.reference, self.view())
