"""The vehicle's knowledge of its own navigation: whether it may be flown on, and the state of its instruments."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sitl.estimation.filter import RUNNING
from sitl.estimation.nominal_state import ATTITUDE_ERROR, POSITION_ERROR, VELOCITY_ERROR, WIND_ERROR
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import (
    BAROMETER,
    EXTERNAL_POSE,
    FIRST_DELAYED,
    GNSS,
    INSTRUMENTS,
    MAGNETOMETER,
    MOTION_CAPTURE,
    N_DELAYED,
    PITOT,
)
from sitl.simulation.avionics import Avionics, Navigation

SILENT_TIME = 1.0  # an instrument that has read nothing for so long does not work [s]
PLACES = (GNSS, MOTION_CAPTURE, EXTERNAL_POSE)  # instruments that tell the position
OTHER_AIDS = {MAGNETOMETER: "magnetometer", BAROMETER: "barometer"}  # what only degrades navigation, to the pilot
EXACT = Vector(0.0, 0.0, 0.0)
NEVER = math.inf
MAX_RATIO = 100.0  # what is said of a reading that is farther off


class Aid(NamedTuple):
    """Contribution of one instrument to the filter."""

    read_age: float = NEVER  # since its last reading was made [s]
    fused_age: float = NEVER  # since one was fused [s]
    ratio: float = 0.0  # innovation of the last one over what the filter allows, worst axis

    @property
    def reads(self) -> bool:
        """Whether it has read lately."""
        return self.read_age < SILENT_TIME

    @property
    def helps(self) -> bool:
        """Whether its readings have been fused lately."""
        return self.fused_age < SILENT_TIME


class NavigationStatus(NamedTuple):
    """Navigation at one instant; of a vehicle that sees the truth, nothing is uncertain."""

    source: Navigation = Navigation.TRUTH
    is_aligned: bool = True  # the filter runs
    awaited: tuple[str, ...] = ()  # why it is not ready for a flight, in plain words
    position_age: float = 0.0  # since the last aid of the position [s]
    has_cameras: bool = True  # the arena's own are simulated; else poses come from peers
    aids: tuple[Aid, ...] = (Aid(),) * N_DELAYED  # by instrument less FIRST_DELAYED
    position_deviation: Vector = EXACT  # [m]
    velocity_deviation: Vector = EXACT  # [m/s]
    attitude_deviation: Vector = EXACT  # [rad]
    wind_deviation: Vector = EXACT  # [m/s]
    resets: int = 0  # of position, velocity or attitude to a reading
    failed: tuple[bool, ...] = (False,) * INSTRUMENTS  # instruments that the filter has found to fail

    @property
    def is_sensed(self) -> bool:
        """Whether the estimate comes from sensors."""
        return self.source is not Navigation.TRUTH

    def aid(self, instrument: int) -> Aid:
        """Contribution of an instrument, from MAGNETOMETER on, to the filter."""
        return self.aids[instrument - FIRST_DELAYED]

    @property
    def unfused(self) -> tuple[str, ...]:
        """Instruments that the filter goes on without, though the vehicle has them."""
        if not self.is_sensed or not self.is_aligned:
            return ()
        failed = ("pitot tube",) if self.failed[PITOT] else ()
        if self.source is not Navigation.SENSORS:
            return failed
        return (*(name for instrument, name in OTHER_AIDS.items() if not self.aid(instrument).helps), *failed)


def navigation_status(avionics: Avionics, period: int) -> NavigationStatus:
    """The status now.

    Args:
        avionics: Of the vehicle.
        period: Control periods flown.
    """
    if not avionics.is_sensed:
        return NavigationStatus()
    f = avionics.filter
    is_aligned = int(f.phase) == RUNNING
    aids = _aids(avionics, period)
    age = min(aids[instrument - FIRST_DELAYED].fused_age for instrument in PLACES)
    deviations = np.sqrt(np.maximum(np.diagonal(f.covariance), 0.0)).tolist()
    status = NavigationStatus(
        source=avionics.navigation,
        is_aligned=is_aligned,
        position_age=age,
        has_cameras=avionics.has_cameras,
        aids=aids,
        position_deviation=_part(deviations, POSITION_ERROR),
        velocity_deviation=_part(deviations, VELOCITY_ERROR),
        attitude_deviation=_part(deviations, ATTITUDE_ERROR),
        wind_deviation=_part(deviations, WIND_ERROR),
        resets=int(f.resets),
        failed=tuple(failed > 0.0 for failed in f.failed.tolist()),
    )
    return status._replace(awaited=_awaited(status))


def _aids(avionics: Avionics, period: int) -> tuple[Aid, ...]:
    f, i = avionics.filter, avionics.instruments
    read = i.sampled.max(axis=1).tolist()
    fused, gate = f.fused_at.tolist(), float(f.settings.gate)
    ratios = np.minimum(np.sqrt(f.ratio) / gate, MAX_RATIO).tolist()
    return tuple(
        Aid(
            (period - sampled) * PERIOD if sampled > 0.0 else NEVER,
            (period - at) * PERIOD if at >= 0.0 else NEVER,
            ratio,
        )
        for sampled, at, ratio in zip(read, fused, ratios, strict=True)
    )


def _part(numbers: Sequence[float], first: int) -> Vector:
    return Vector(numbers[first], numbers[first + 1], numbers[first + 2])


def _awaited(s: NavigationStatus) -> tuple[str, ...]:
    """Conditions that a flight still has to wait for, in plain words."""
    missing = [_place_text(s)] if not any(s.aid(instrument).reads for instrument in PLACES) else []
    if s.source is Navigation.SENSORS:
        missing += [f"no {name}" for instrument, name in OTHER_AIDS.items() if not s.aid(instrument).reads]
    if not s.is_aligned and not missing:
        return ("aligning: keep still",)
    if s.is_aligned and not missing and s.position_age >= SILENT_TIME:
        return ("position not known yet",)
    return tuple(missing)


def _place_text(s: NavigationStatus) -> str:
    if s.source is not Navigation.MOCAP:
        return "waiting for satellites"
    return "no motion capture" if s.has_cameras else "waiting for poses of motion capture"
