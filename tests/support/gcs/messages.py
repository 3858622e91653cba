"""Messages as they arrive at a ground station."""

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, Law, LegMode, Reason
from protocol.names import Mode, custom_mode
from protocol.wire.codec import Codec

VEHICLE, OTHER_VEHICLE = Codec(1, 1), Codec(7, 1)


def arrived(message, codec=VEHICLE):
    """A message after its way over the wire."""
    return Codec(255, 190).decode(codec.encode(message))[0]


def heartbeat(
    *,
    armed=False,
    mode=None,
    state=mavlink.MAV_STATE_ACTIVE,
    kind=mavlink.MAV_TYPE_VTOL_DUOROTOR,
    autopilot=mavlink.MAV_AUTOPILOT_PX4,
):
    flag = mavlink.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0
    return mavlink.MAVLink_heartbeat_message(
        type=kind,
        autopilot=autopilot,
        base_mode=mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | flag,
        custom_mode=custom_mode(Mode.HOLD) if mode is None else mode,
        system_status=state,
        mavlink_version=3,
    )


def station_heartbeat(kind=mavlink.MAV_TYPE_GCS):
    return heartbeat(kind=kind, autopilot=mavlink.MAV_AUTOPILOT_INVALID, mode=0)


def position(ms, x, y=0.0, z=-3.0, vx=0.0):
    return mavlink.MAVLink_local_position_ned_message(time_boot_ms=ms, x=x, y=y, z=z, vx=vx, vy=0, vz=0)


def text(words, *, severity=mavlink.MAV_SEVERITY_WARNING, number=0, chunk=0):
    return mavlink.MAVLink_statustext_message(severity=severity, text=words, id=number, chunk_seq=chunk)


def command_long(command, *params, target=(1, 1)):
    """COMMAND_LONG; parameters that are not given are 0."""
    names = (f"param{number}" for number in range(1, 8))
    values = dict(zip(names, (*params, *(0.0,) * (7 - len(params))), strict=True))
    return mavlink.MAVLink_command_long_message(
        target_system=target[0], target_component=target[1], command=command, confirmation=0, **values
    )


def jump(number, v, *, usec=1_000_000, name=b"enter_linear"):
    """From the zero-moment to the linear law."""
    return mavlink.MAVLink_darko_jump_message(
        time_usec=usec,
        jump=number,
        v=v,
        law_from=Law.HOVER_ZERO_MOMENT,
        law_to=Law.HOVER_LINEAR,
        reason=Reason.LYAPUNOV_BELOW,
        name=name,
    )


def decision(
    *, way=LegMode.FORWARD, reason=DecisionReason.ENERGY, seq=3, times=(29.2, 12.1), energies=(4983.0, 1757.0)
):
    """A leg of 100 m that climbs 10 m; ``times`` and ``energies`` are of hover and forward flight."""
    return mavlink.MAVLink_darko_decision_message(
        time_boot_ms=59_000,
        distance=100.0,
        climb=10.0,
        tail_wind=-1.2,
        cross_wind=0.5,
        hover_time=times[0],
        hover_energy=energies[0],
        forward_time=times[1],
        forward_energy=energies[1],
        seq=seq,
        way=way,
        reason=reason,
    )


def vtol_state(state):
    return mavlink.MAVLink_extended_sys_state_message(vtol_state=state, landed_state=mavlink.MAV_LANDED_STATE_IN_AIR)


def path_error(metres, *, altitude_error=0.0, distance=0, bearing=0):
    return mavlink.MAVLink_nav_controller_output_message(
        nav_roll=0,
        nav_pitch=0,
        nav_bearing=0,
        target_bearing=bearing,
        wp_dist=distance,
        alt_error=altitude_error,
        aspd_error=0,
        xtrack_error=metres,
    )
