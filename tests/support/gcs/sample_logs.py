"""Two short recorded flights, one message per second: a hover, and a mission with both transitions."""

import math

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, Law, LegMode
from protocol.names import Mode, custom_mode
from tests.support.gcs.messages import (
    decision,
    heartbeat,
    jump,
    path_error,
    position,
    station_heartbeat,
    text,
    vtol_state,
)
from tests.support.logs import bare, log_of
from tests.support.vehicle.darko_messages import energy, hybrid_state

SECOND = 1_000_000  # [us]
NO_ITEM = 0xFFFF


def beat(mode, *, armed=False):
    return heartbeat(mode=custom_mode(mode), armed=armed)


def at(north, height, speed):
    """A position in the local frame [m] with a speed northwards [m/s]."""
    return position(0, north, z=-height, vx=speed)


def law(number, second):
    return hybrid_state(1000 * second, number)


def made_each_second(messages):
    """The frames of messages, each told to be made a second after the one before."""
    for second, message in enumerate(messages):
        for field, ticks in (("time_boot_ms", 1000), ("time_usec", SECOND)):
            if field in message.fieldnames:
                setattr(message, field, ticks * second)
        yield bare(message)


def log_of_messages(messages):
    return log_of(made_each_second(messages), step=SECOND)


HOVER_FLIGHT = [
    beat(Mode.HOLD),
    at(50.0, 0.0, 0.0),  # carried to its place, not flown there
    beat(Mode.TAKEOFF, armed=True),
    at(0.0, 0.0, 0.0),
    at(3.0, 4.0, 1.5),
    law(Law.HOVER_ZERO_MOMENT, 5),
    jump(1, 0.25, name=b"calm"),
    law(Law.HOVER_LINEAR, 7),
    law(Law.HOVER_LINEAR, 8),
    at(3.0, 9.0, 0.5),
    beat(Mode.MISSION, armed=True),
    text(b"a long wa", number=7, chunk=0),
    text(b"rning", number=7, chunk=1),
    jump(2, math.nan, name=b"calm"),
    beat(Mode.LAND),
    text(b"landed\x1b[2J"),
]


def hover_log():
    """The log of the hover, with a heartbeat of the ground station at its end."""
    return log_of([*made_each_second(HOVER_FLIGHT), bare(station_heartbeat(), system=255, component=190)], step=SECOND)


FORWARD_FLIGHT = [
    beat(Mode.HOLD),
    path_error(50.0),  # disarmed: not counted
    beat(Mode.MISSION, armed=True),
    vtol_state(mavlink.MAV_VTOL_STATE_MC),
    energy(100.0, {Law.HOVER_LINEAR: 100.0}),
    decision(seq=2, times=(29.25, 12.125), way=LegMode.FORWARD, reason=DecisionReason.ENERGY),
    law(Law.TO_FORWARD, 6),
    vtol_state(mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW),
    path_error(3.0),
    law(Law.FORWARD_LINEAR, 9),
    vtol_state(mavlink.MAV_VTOL_STATE_FW),
    energy(1500.0, {Law.HOVER_LINEAR: 150.0, Law.TO_FORWARD: 900.0, Law.FORWARD_LINEAR: 450.0}),
    path_error(-4.0),
    path_error(math.nan),
    decision(seq=NO_ITEM, times=(29.25, math.inf), way=LegMode.HOVER, reason=DecisionReason.NO_TRIM),
    energy(5.0, {Law.HOVER_LINEAR: 5.0}),  # after a restart
]
