r"""Paparazzi's INDI of this aircraft as constants of the law of :mod:`sitl.control.indi`: gains, filters and effects.

The numbers are those of ENAC's airframe file (``conf/airframes/ENAC/darko3_indi.xml`` of its fork of Paparazzi); their
units are read out of ``stabilization_indi.c`` and ``guidance_indi_hybrid.c`` there. A command has 9600 pprz; G1 is
1000 times the angular acceleration [rad/s2], or the specific force [m/s2], of one pprz. Hover axes: roll turns about
z_b, by the motors; pitch about y_b; yaw about x_b.

The law knows an airframe, not a matrix. So inertias and mass of what it believes are those by which the hover has this
effectiveness, and its actuators lag as ACT_DYN says. Left out: the weighted allocation, for which ours stays, what is
scheduled by airspeed from 6 m/s on and by pitch from 30 deg on, and the feed-forward of turns above 10 m/s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl.control.indi import IndiGains
from sitl.control.indi_guidance import IndiGuidanceGains
from sitl.design.gains import indi_gains
from sitl.model.aerodynamics import force_matrix, inertia, moment_matrix
from sitl.model.airframe import Airframe
from sitl.model.propeller import hover_speed, thrust
from sitl.model.vectors import Vector

PPRZ_RANGE = 9600.0  # pprz
FULL_DEFLECTION = math.radians(30.0)  # at it: the author's code sends an elevon 6 / pi times 9600 per radian
FULL_MOTOR = 16066.0 * math.pi / 30.0  # at it [rad/s]
LOOP_RATE = 512.0  # [Hz]
G1_SCALE = 1000.0
G1_ROLL = (15.0, 15.0)  # of the motors
G1_PITCH = (4.0, 4.3)  # of the elevons
G1_YAW = (3.9, 3.8)
G1_THRUST = (1.0, 1.5)  # of the motors
ELEVON_DYNAMICS, MOTOR_DYNAMICS = 0.04, 0.025  # ACT_DYN: share of the way in a step
ERROR_GAIN, RATE_GAIN = 120.0, 12.0  # REF_ERR, of half the angle; REF_RATE
FILTER = 5.0  # FILT_CUTOFF of stabilization, and so of guidance [Hz]
POSITION_GAIN, SPEED_GAIN, HEIGHT_GAIN, CLIMB_GAIN = 0.2, 1.0, 0.5, 1.8
CLIMB_LIMIT = 1.5  # [m/s]
LEVEL_LIMIT, LEVEL_LIMIT_FAST = 3.0, 8.0  # level, at rest and at the greatest airspeed [m/s2]
RISING_LIMIT = 3.0  # vertical [m/s2]


class Effectiveness(NamedTuple):
    """Of one pprz in the hover: angular accelerations about the hover's axes [rad/s2], specific force [m/s2]."""

    roll: float  # of a motor
    pitch: float  # of an elevon
    yaw: float  # of an elevon
    thrust: float  # of a motor


def printed() -> Effectiveness:
    """Of the airframe file, both sides' mean."""
    return Effectiveness(*(float(np.mean(row)) / G1_SCALE for row in (G1_ROLL, G1_PITCH, G1_YAW, G1_THRUST)))


def computed(a: Airframe, speed: float) -> Effectiveness:
    """Of an airframe's own model at a speed of its propellers [rad/s]."""
    M, J = moment_matrix(a), inertia(a)
    by_motor = (2.0 * a.k_f * speed + a.k_fw) * FULL_MOTOR / PPRZ_RANGE  # thrust of one pprz [N]
    by_elevon = float(thrust(speed, 0.0, a)) * FULL_DEFLECTION / PPRZ_RANGE  # deflection times thrust [N rad]
    return Effectiveness(
        roll=abs(float(M[2, 0])) * by_motor / float(J[2]),
        pitch=abs(float(M[1, 2])) * by_elevon / float(J[1]),
        yaw=abs(float(M[0, 2])) * by_elevon / float(J[0]),
        thrust=float(force_matrix(a)[0, 0]) * by_motor / a.m,
    )


def believed(a: Airframe) -> Airframe:
    """The airframe that the law is to know, for the effectiveness and the lags of the airframe file."""
    own, theirs = computed(a, hover_speed(a)), printed()
    return a._replace(
        J1=a.J1 * own.yaw / theirs.yaw,
        J2=a.J2 * own.pitch / theirs.pitch,
        J3=a.J3 * own.roll / theirs.roll,
        m=a.m * own.thrust / theirs.thrust,
        motor_tau=_time_constant(MOTOR_DYNAMICS),
        elevon_tau=_time_constant(ELEVON_DYNAMICS),
    )


def _time_constant(share: float) -> float:
    """Of a first-order lag that goes such a share of its way in a step [s]."""
    return -1.0 / (LOOP_RATE * math.log(1.0 - share))


def paparazzi_gains() -> IndiGains:
    """The gains of the airframe file; what it has no counterpart of is ours."""
    own, filtered = indi_gains(), 2.0 * math.pi * FILTER
    turn = 0.5 * ERROR_GAIN / RATE_GAIN
    return own._replace(
        guidance=_guidance(own.guidance),
        attitude=Vector(turn, turn, turn),
        rate=Vector(RATE_GAIN, RATE_GAIN, RATE_GAIN),
        force_filter=filtered,
        moment_filter=filtered,
    )


def _guidance(own: IndiGuidanceGains) -> IndiGuidanceGains:
    return own._replace(
        k_p=POSITION_GAIN,
        k_v=SPEED_GAIN,
        k_z=HEIGHT_GAIN,
        k_vz=CLIMB_GAIN,
        max_forward=LEVEL_LIMIT,
        min_turn=LEVEL_LIMIT,
        max_turn=LEVEL_LIMIT_FAST,
        max_rise=CLIMB_LIMIT,
        max_sink=CLIMB_LIMIT,
        max_up=RISING_LIMIT,
        max_down=RISING_LIMIT,
    )
