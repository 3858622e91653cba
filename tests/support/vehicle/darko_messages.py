"""Messages of the private dialect, of which a test says what matters to it."""

import math

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Reason

LAWS = 16  # entries of DARKO_ENERGY.energy_by_law


def hybrid_state(ms, law=Law.HOVER_LINEAR, **told):
    fields = {
        "jumps": 2,
        "v_hover": 1.0,
        "v_forward": math.nan,
        "v_attitude": math.nan,
        "v_hover_enter": 50.0,
        "v_hover_leave": 100.0,
        "v_forward_enter": 5.0,
        "v_forward_leave": 20.0,
        "governor": 0.0,
        "last_law": Law.HOVER_ZERO_MOMENT,
        "last_reason": Reason.LYAPUNOV_BELOW,
    }
    return mavlink.MAVLink_darko_hybrid_state_message(time_boot_ms=ms, law=law, **fields | told)


def actuators(ms, limits=0, saturation=0):
    return mavlink.MAVLink_darko_actuators_message(
        time_boot_ms=ms,
        motor_speed=[2, 3],
        motor_command=[4, 5],
        thrust=[6, 7],
        elevon=[0, 0],
        elevon_command=[0, 0],
        motor_min=200,
        motor_max=1000,
        elevon_max=0.5,
        limits=limits,
        saturation=saturation,
    )


def energy(total, by_law, power=100.0):
    told = [by_law.get(number, 0.0) for number in range(LAWS)]
    return mavlink.MAVLink_darko_energy_message(time_boot_ms=0, power=power, energy=total, energy_by_law=told)
