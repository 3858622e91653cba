"""The controller's state: the discrete part of the hybrid system, its timers, and the states of its laws."""

from typing import NamedTuple

from sitl.control.laws import LawStates
from sitl.control.wind_estimator import WindState
from sitl.model.state import Actuators


class Controller(NamedTuple):
    """All that the controller keeps from one control period to the next."""

    law: int  # in force
    is_armed: bool
    has_crashed: bool  # it hit the ground too fast, and stays where it is
    is_flying: bool  # the autopilot wants to be in the air
    is_landing: bool  # the autopilot wants to touch the ground
    law_time: float  # how long the law has been in force [s]
    at_rest: float  # how long the vehicle has rested on the ground [s]
    inhibited: float  # how long the linear hover law must not be entered yet [s]
    command: Actuators  # of the last period, in force in the next
    saturation: int  # DARKO_SATURATION bits of the last period
    wind: WindState  # of the wind estimator
    states: LawStates
