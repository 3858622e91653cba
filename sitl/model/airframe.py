"""Parameters of the vehicle as the kernels take them: flat, immutable, SI units."""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from sitl.compiled import kernel

Array: TypeAlias = npt.NDArray[np.float64]

SATURATED = 0  # actuator model: position and rate limits (report, "Saturation des commandes")
FIRST_ORDER = 1  # actuator model: position limits and a first-order lag (the report's alternative)
REPORT, PASSIVE, STALL = range(3)  # level of the aerodynamics; see sitl.model.aerodynamics
SHAFT, BATTERY = range(2)  # whose energy is counted


class Airframe(NamedTuple):
    """Everything the plant needs to know of one airframe.

    The three damping rows are those of Phi(m w) without the factor 1/2, which the equations carry.
    """

    m: float  # mass [kg]
    J1: float  # principal inertia about x_b [kg m2]
    J2: float  # principal inertia about y_b [kg m2]
    J3: float  # principal inertia about z_b [kg m2]
    g: float  # gravity [m/s2]
    rho: float  # air density [kg/m3]
    S: float  # wing area [m2]
    b: float  # span [m]
    c: float  # mean chord [m]
    S_ratio: float  # S / (4 S_p): wing area over four propeller discs [-]
    C_l: float  # normal force slope, third entry of Phi(fv) [1/rad]
    C_d0: float  # axial coefficient, first entry of Phi(fv) [-]
    C_y0: float  # lateral coefficient, second entry of Phi(fv) [-]
    xi_f: float  # elevon effectiveness on force [-]
    xi_m: float  # elevon effectiveness on moment [-]
    Delta_r: float  # aerodynamic centre behind the centre of mass [m]
    a_y: float  # lateral arm of a half wing's aerodynamic centre [m]
    p_x: float  # axial arm of a motor [m]
    p_y: float  # lateral arm of a motor [m]
    k_f: float  # thrust T = k_f w^2 [kg m]
    k_m: float  # propeller torque N = k_m w^2 [kg m2]
    C_lp: float  # roll damping by p [-]
    C_lq: float  # roll damping by q [-]
    C_lr: float  # roll damping by r [-]
    C_mp: float  # pitch damping by p [-]
    C_mq: float  # pitch damping by q [-]
    C_mr: float  # pitch damping by r [-]
    C_np: float  # yaw damping by p [-]
    C_nq: float  # yaw damping by q [-]
    C_nr: float  # yaw damping by r [-]
    mu: float  # weight of c^2 |w|^2 in eta [-]
    omega_min: float  # slowest propeller speed in flight [rad/s]
    omega_max: float  # fastest propeller speed [rad/s]
    omega_rate: float  # propeller acceleration limit [rad/s2]
    delta_max: float  # elevon deflection limit, either way [rad]
    delta_rate: float  # elevon rate limit [rad/s]
    actuator_model: int  # SATURATED or FIRST_ORDER
    motor_tau: float  # time constant of a motor in the first-order model [s]
    elevon_tau: float  # time constant of an elevon in the first-order model [s]
    foot_x: float  # the tail's contact points: distance behind the centre of mass [m]
    foot_y: float  # the tail's contact points: half distance along the span [m]
    foot_z: float  # the tail's contact points: half distance along z_b [m]
    max_contact_speed: float  # at which it may hit the ground, normal to it, and still fly [m/s]
    vibration_speed: float = 600.0  # of the propellers, at which instruments state their vibration [rad/s]
    # What the report's sets do without: air along the propellers' axis, stall, rotors, motors and battery.
    k_fv: float = 0.0  # thrust by speed and inflow, T = k_f w^2 + k_fv w V + k_fvv V |V| [kg]
    k_fvv: float = 0.0  # [kg/m]
    k_fw: float = 0.0  # of k_fw w, what slow blades lack: the drag of small Reynolds numbers [kg m/s]
    k_mv: float = 0.0  # torque likewise [kg m]
    k_mvv: float = 0.0  # [kg]
    k_mk: float = 0.0  # torque by the square of what V is above advance_knot w [kg]
    advance_knot: float = 0.0  # [m/rad]
    J_p: float = 0.0  # inertia of a rotor about its axis [kg m2]
    S_p: float = 0.05  # disc of a propeller [m2]
    aerodynamics: int = REPORT  # REPORT, PASSIVE or STALL
    C_90: float = 1.2  # normal force coefficient across the stream [-]
    per_stall: float = 8.5  # 1 / sin^2 of the incidence where half of the flow is detached [-]
    cp_shift: float = 0.0  # of the centre of pressure, from attached flow to across the stream [m]
    slip_shift: float = 0.0  # the same in the slipstream [m]
    blown_share: float = 0.5  # of the wing, in the slipstreams [-]
    swirl: float = 0.0  # slipstream at rest: speed of its turning at the wing over its speed along x_b [-]
    k_fc: float = 0.0  # thrust by air across the axis, k_fc v^2 while slow against the slipstream [kg/m]
    k_h: float = 0.0  # force of a propeller in its disc against air across it, k_h w v [kg]
    energy_account: int = SHAFT  # SHAFT or BATTERY
    motor_constant: float = 0.01  # volts per speed, and torque per ampere [V s]
    motor_resistance: float = 0.1  # [ohm]
    idle_current: float = 0.5  # [A]
    controller_efficiency: float = 0.95  # of a speed controller [-]
    avionics_power: float = 0.0  # [W]
    battery_voltage: float = 11.1  # of the cells, half charged [V]
    battery_resistance: float = 0.03  # [ohm]


@kernel
def elevon_arm(a: Airframe) -> float:
    """Of an elevon's normal force behind the centre of mass [m]."""
    return a.Delta_r * a.xi_m / a.xi_f


@kernel
def attached_share(sine: float, a: Airframe) -> float:
    """Share of the flow that is attached at an incidence, of whose sine it is told."""
    beyond = sine * sine * a.per_stall
    return 1.0 / (1.0 + beyond * beyond)


@kernel
def slipstream_slope(a: Airframe) -> float:
    """Slope of the elevons' force in the slipstream at rest, which its swirl may stall [1/rad]."""
    if a.swirl == 0.0:
        return a.C_l
    flow = math.sqrt(1.0 + a.swirl * a.swirl)  # over the speed along x_b
    attached = attached_share(a.swirl / flow, a)
    return (attached * a.C_l + (1.0 - attached) * a.C_90) * flow
