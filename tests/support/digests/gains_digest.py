"""Prints one hash over every number of every default design: run as a process of its own."""

import hashlib

import numpy as np

from sitl.design.forward import can_fly_forward, line_of_sight_gains
from sitl.design.forward_schedule import forward_gains
from sitl.design.lmi import lmi_gains
from sitl.design.lqr import hover_gains
from sitl.design.trim import braking_limit, trims
from sitl.design.turn import turning_trim
from sitl.design.zero_moment import zero_moment_gains
from sitl.model.airframe_files import load

WRONG = "m", "J1", "J2", "J3", "C_l", "C_d0", "xi_f", "xi_m", "Delta_r", "k_f", "k_m"  # and by 7 %, up and down
BY_LMI = ("wrong",)  # its steps are the same for all, and take most of the time


def airframes():
    """Three shipped sets, and one whose parameters are wrong."""
    sets = {name: load(name).parameters for name in ("nominal", "published", "flight-code")}
    a = sets["nominal"]
    factors = (1.07, 0.93, 1.07, 0.93, 0.93, 1.07, 1.07, 0.93, 0.93, 1.07, 0.93)
    wrong = {key: getattr(a, key) * factor for key, factor in zip(WRONG, factors, strict=True)}
    return {**sets, "wrong": a._replace(**wrong)}


def designs(name, a):
    """All that is designed for an airframe."""
    yield hover_gains(a)
    yield hover_gains(a, integral=False)
    if name in BY_LMI:
        yield lmi_gains(a)
    yield forward_gains(a)
    yield zero_moment_gains(a)
    yield line_of_sight_gains(), can_fly_forward(a)
    yield trims(a, np.arange(26.0), 0.2, -0.5)
    yield braking_limit(a, np.arange(26.0), 0.1)
    yield [turning_trim(a, speed, 0.4) for speed in (3.0, 9.0, 18.0)]


def numbers(value):
    """Every number in a structure, as text that is exact."""
    if isinstance(value, np.ndarray):
        yield from (float(x).hex() for x in value.ravel())
    elif isinstance(value, tuple | list):
        for part in value:
            yield from numbers(part)
    else:
        yield float(value).hex()


if __name__ == "__main__":
    every = [number for name, a in airframes().items() for design in designs(name, a) for number in numbers(design)]
    print(len(every), hashlib.sha256("\n".join(every).encode()).hexdigest())
