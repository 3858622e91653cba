"""Forward flight in the vertical plane under the report's own law, its governor and its Jacobians."""

from __future__ import annotations

import math

import numpy as np

from sitl import Airframe, Array
from sitl.control.governor import arctan_sigmoid, gompertz
from sitl.design.lqr import hover_thrust
from sitl.lab.reproduction.equations.as_typed import Slip, jacobian, kernel_wrench, steady_climb
from sitl.lab.reproduction.equations.report_forward_flight import ForwardFlight, conditioning, fly
from sitl.lab.reproduction.equations.report_forward_law import ReportForwardGains, model
from sitl.lab.reproduction.experiment import (
    REPORT_SET,
    Conditions,
    Experiment,
    ExperimentResult,
    Illustration,
    Panel,
    Recomputation,
    Statement,
    above,
    below,
    printed,
)
from sitl.lab.reproduction.flight_panels import COLOURS, SEQUENCE, SvgSheet, draw_angles, thin

# Forward flight in the vertical plane under the report's own law (report, section 4.2.3).

# The sigmoids of the quasi time-optimal governor (report, section 3.2.1, figure 3.7).


SIGMOID_LIMIT = 1.0  # M: with the printed c = 1 the only one the report can have drawn


def printed_gompertz(x: Array, M: float = SIGMOID_LIMIT) -> Array:
    """The Gompertz function as the report prints it: b = -ln(1/2), c = 1."""
    return np.asarray(2.0 * M * np.exp(-np.exp(math.log(2.0) - x)) - M)


def run_governor_sigmoids(conditions: Conditions) -> ExperimentResult:  # noqa: ARG001 - it depends on nothing
    """The distance of both sigmoids to the discontinuous saturation."""
    x = np.linspace(-6.0, 6.0, 1201)
    hard = np.clip(x, -SIGMOID_LIMIT, SIGMOID_LIMIT)
    ours = np.array([gompertz(value, SIGMOID_LIMIT) for value in x])
    arctan = np.array([arctan_sigmoid(value, SIGMOID_LIMIT) for value in x])
    typed = printed_gompertz(x)
    nearer, typed_nearer = (_area(x, curve - hard) / _area(x, arctan - hard) for curve in (ours, typed))
    statement = Statement(
        "3.2.1", "area to the hard saturation, Gompertz as printed over arctan", below(1.0, "nearer than the arctan"),
        typed_nearer,
        cause=Recomputation("b = ln ln 2, c = 1 / (M ln 2), made odd: it vanishes at zero, with slope one", nearer),
    )  # fmt: skip
    sheet = SvgSheet("sigmoids", height=3.2)
    with sheet as axes:
        for curve, label, style in (
            (hard, "saturation", ":"), (ours, "Gompertz, corrected", "-"), (arctan, "arctan", "-"),
            (typed, "Gompertz, as printed", "--"),
        ):  # fmt: skip
            axes[0].plot(x, curve, style, label=label)
        axes[0].set(xlabel="x / M", ylabel="sigma / M")
        axes[0].legend(loc="lower right")
        axes[0].grid(alpha=0.2)
    panel = Panel(
        "3.7", "Comparison of two sigmoid functions",
        "The Gompertz function comes closer to the discontinuous saturation than the arctangent.",
        f"True of the corrected one: {nearer:.2f} of the arctangent's area. The printed one does not "
        f"pass through zero ({float(printed_gompertz(np.zeros(1))[0]):+.2f} M there).", sheet.svg,
    )  # fmt: skip
    return ExperimentResult([statement], [panel])


def _area(x: Array, gap: Array) -> float:
    return float(np.abs(gap).sum() * (x[1] - x[0]))


GOVERNOR_SIGMOIDS = Experiment(
    "sigmoids",
    "Sigmoids of the saturation",
    "3.2.1",
    "The governor saturates with a sigmoid. The report prefers a Gompertz function to the arctangent because it is "
    "nearer to a saturation. Its printed constants do not make it vanish at zero.",
    run_governor_sigmoids,
    airframes=(),
)


# Condition number of the moment's Jacobian, with the report's M_y and with the corrected one (report, 4.2.2).


def jacobian_row(a: Airframe) -> Statement:
    """The printed Jacobian against differences of the kernel's moment, at the hover."""
    T = hover_thrust(a).T1
    kernel = jacobian(lambda u_bar: _kernel_moment(2.0 * T, u_bar, a), np.zeros(3), 3)
    command = np.array([2.0 * T, 0.0, 0.0, 0.0])
    ours, printed_one = (
        float(abs(model(np.zeros(3), 0.0, command, ReportForwardGains(a, swapped=swapped))[1] - kernel).max())
        for swapped in (0, 1)
    )
    return Statement(
        "4.2.2", "dM/du as printed less the kernel's at the hover, largest entry", printed("0.00"), printed_one, "N m",
        Recomputation("M_y with T1 + T2 and T1 - T2 in their places", ours),
        note="of T1 - T2, delta1 + delta2, delta1 - delta2; signs of FLU and the yaw arm corrected",
    )  # fmt: skip


def _kernel_moment(total: float, u_bar: Array, a: Airframe) -> Array:
    """Moment of the kernel at rest for T1 + T2 [N] and u_bar = (T1 - T2, d1 + d2, d1 - d2)."""
    T = 0.5 * np.array([total + u_bar[0], total - u_bar[0]])
    deflections = 0.5 * np.array([u_bar[1] + u_bar[2], u_bar[1] - u_bar[2]])
    return kernel_wrench(np.zeros(3), np.zeros(3), T, deflections, a)[1]


def conditioning_row(a: Airframe) -> Statement:
    """The greatest condition number along the level trims."""
    ours, typed = (
        max(conditioning(a, float(speed), swapped=swapped) for speed in range(26)) for swapped in (False, True)
    )
    return Statement(
        "4.2.2", "condition number of dM/du, greatest in level flight from 0 to 25 m/s", above(1e14, "> 1e14"), ours,
        cause=Recomputation("M_y with T1 - T2 and T1 + T2 exchanged, as printed: singular at the hover", typed),
        note="by singular values; the report takes eigenvalues",
    )  # fmt: skip


def conditioning_panel(a: Airframe) -> Panel:
    """Condition numbers over airspeed."""
    speeds = np.linspace(0.0, 25.0, 101)
    sheet = SvgSheet("forward-conditioning", height=2.4)
    with sheet as axes:
        for swapped, style, word in ((False, "-", "corrected"), (True, "--", "as typed")):
            values = [min(conditioning(a, float(speed), swapped=swapped), 1e8) for speed in speeds]
            axes[0].semilogy(speeds, values, style, label=word)
        axes[0].set(xlabel="level airspeed [m/s]", ylabel="condition number")
        axes[0].legend()
        axes[0].grid(alpha=0.2)
    return Panel(
        "", "Condition number of dM/du along the level trims",
        "The system is badly conditioned: its Jacobian cannot be inverted.",
        "As typed it is singular at the hover; corrected it never exceeds "
        f"{max(conditioning(a, float(speed), swapped=False) for speed in speeds):.0f}.", sheet.svg,
    )  # fmt: skip


CLIMB_TARGET = (1000.0, 0.0, 1000.0)  # [m]
CLIMB_SPEED = 20.0  # [m/s]
CLIMB_TIME = 65.0  # [s]
PRINTED_NOSE, PRINTED_MOTORS = 54.0, 661.0  # where both settle in section 4.2.3 [deg, rad/s]
HOVER_METRES_PER_SECOND = 1.72  # of the report's comparison of energies
SIDEWAYS_TARGET = (2000.0, 2000.0, 0.0)  # a target outside the vertical plane [m]
PLACE = "4.2.3"  # in the report


def run(conditions: Conditions) -> ExperimentResult:
    """Figures 4.2 to 4.5 with the law corrected and as typed."""
    a = conditions.airframe(REPORT_SET)
    ours = fly(CLIMB_TARGET, ReportForwardGains(a), speed=CLIMB_SPEED, duration=CLIMB_TIME)
    slipped = ReportForwardGains(a, swapped=1, singular_floor=1e-3)
    typed = fly(CLIMB_TARGET, slipped, speed=CLIMB_SPEED, duration=CLIMB_TIME)
    sideways = fly(SIDEWAYS_TARGET, ReportForwardGains(a), speed=CLIMB_SPEED, duration=40.0)
    statements = [*_steady(a), *_flown(ours, typed), jacobian_row(a), conditioning_row(a), _energy(a)]
    panels = [_position(ours, typed), _plane(ours, typed), _attitude(ours, typed), _commands(ours, typed)]
    illustrations = [*_bends(ours, typed), _sideways(sideways)]
    return ExperimentResult(statements, [*panels, _lasting_error(a), conditioning_panel(a)], illustrations)


def _steady(a: Airframe) -> list[Statement]:
    """The two printed numbers of the climb belong to one steady flight, whatever the gains."""
    nose, path = _climb_at_printed_motors(a, frozenset())
    nose_by_area, path_by_area = _climb_at_printed_motors(a, frozenset({Slip.AREA}))
    climb, area = f"steady climb in which the motors turn at {PRINTED_MOTORS:.0f} rad/s", Slip.AREA.value
    return [
        Statement(PLACE, f"nose of the {climb}", printed(f"{PRINTED_NOSE:.0f}"), nose, "deg",
                  Recomputation(area, nose_by_area), note="at v_bx = 20 m/s; needs no gain"),
        Statement(PLACE, f"path of the {climb}", printed("45"), path, "deg", Recomputation(area, path_by_area)),
    ]  # fmt: skip


def _climb_at_printed_motors(a: Airframe, slips: frozenset[Slip]) -> tuple[float, float]:
    """Nose and path of the climb at CLIMB_SPEED with PRINTED_MOTORS [deg]; NaN if there is none."""
    from scipy.optimize import brentq  # noqa: PLC0415 - a second that only designs need

    def excess(path: float) -> float:
        return steady_climb(a, CLIMB_SPEED, path, slips)[1] - PRINTED_MOTORS

    low, high = math.radians(30.0), math.radians(75.0)
    if excess(low) * excess(high) > 0.0:
        return math.nan, math.nan
    path = float(brentq(excess, low, high))
    return math.degrees(steady_climb(a, CLIMB_SPEED, path, slips)[0]), math.degrees(path)


def _flown(ours: ForwardFlight, typed: ForwardFlight) -> list[Statement]:
    speed = float(np.linalg.norm(ours.v[-1]))
    off, corrected = (math.degrees(float(flight.angle_off[-1])) for flight in (typed, ours))
    return [
        Statement(PLACE, "airspeed held by the corrected law", printed("20"), speed, "m/s"),
        Statement("4.2.1", "law with M_y as printed: velocity off the line of sight at the end", printed("0"), off,
                  "deg", Recomputation("M_y with T1 + T2 and T1 - T2 in their places", corrected),
                  note="said to converge: compared to the degree"),
    ]  # fmt: skip


def _energy(a: Airframe) -> Statement:
    hovering = math.sqrt(hover_thrust(a).T1 / a.k_f)
    power_ratio = (hovering / PRINTED_MOTORS) ** 3  # each propeller takes k_m w^3
    ratio = power_ratio * CLIMB_SPEED / HOVER_METRES_PER_SECOND
    return Statement(
        PLACE, "energy per metre, hovering at 1.72 m/s over flying at 20 m/s", above(1.0, "flying is cheaper"), ratio,
        note="by the report's propeller, whose energy is an erratum",
    )  # fmt: skip


def _bends(ours: ForwardFlight, typed: ForwardFlight) -> list[Illustration]:
    return [
        Illustration("4.2.3, fig. 4.3", f"farthest from a straight line after 10 s, {name}", _bend(flight), "m",
                     "not straight", "depends on the gains, which the report does not print")
        for name, flight in (("corrected", ours), ("M_y as printed", typed))
    ]  # fmt: skip


def _bend(flight: ForwardFlight) -> float:
    """Maximum distance of the path from its chord, from 10 s on [m]."""
    p = flight.p[flight.at(10.0) :]
    chord = (p[-1] - p[0]) / np.linalg.norm(p[-1] - p[0])
    return float(np.linalg.norm(np.cross(p - p[0], chord), axis=1).max())


def _sideways(flight: ForwardFlight) -> Illustration:
    slip = math.degrees(float(np.abs(flight.sideslip[flight.at(20.0) :]).max()))
    return Illustration(
        PLACE, "target off the plane by 45 deg: sideslip of the corrected law", slip, "deg",
        "only a vertical plane was flown, for want of conditioning",
        "well conditioned, it still sideslips: nothing opposes it (F_y = 0) and the bank is free",
    )  # fmt: skip


def _position(ours: ForwardFlight, typed: ForwardFlight) -> Panel:
    sheet = SvgSheet("forward-position", height=2.6)
    with sheet as axes:
        for name, flight, style in (("corrected", ours, "-"), ("M_y as printed", typed, ":")):
            for column, direction, width in ((0, "north", 2.2), (1, "west", 1.0), (2, "up", 0.9)):
                colour, line = COLOURS[column], thin(flight.time, flight.p[:, column])
                axes[0].plot(*line, style, color=colour, linewidth=width, label=f"{direction}, {name}")
        axes[0].set(xlabel="t [s]", ylabel="position [m]")
        axes[0].legend(fontsize=7, ncols=2)
        axes[0].grid(alpha=0.2)
    return Panel(
        "4.2", "Position under the non-linear forward law",
        "A slight oscillation of the position remains to be solved.",
        "With our gains neither reading of M_y oscillates; the report prints none.", sheet.svg,
    )  # fmt: skip


def _plane(ours: ForwardFlight, typed: ForwardFlight) -> Panel:
    sheet = SvgSheet("forward-plane", height=3.2)
    with sheet as axes:
        for name, flight, style in (("corrected", ours, "-"), ("M_y as printed", typed, "--")):
            axes[0].plot(*thin(flight.p[:, 0], flight.p[:, 2]), style, label=name)
        axes[0].plot([0.0, 1000.0], [0.0, 1000.0], ":", label="line to the target")
        axes[0].set(xlabel="north [m]", ylabel="up [m]")
        axes[0].legend()
        axes[0].grid(alpha=0.2)
    return Panel(
        "4.3", "Position in the vertical plane", "The path is not straight, which is due to the line-of-sight command.",
        f"After ten seconds the corrected path is straight to {_bend(ours):.0f} m; with M_y as printed it bends by "
        f"{_bend(typed):.0f} m.", sheet.svg,
    )  # fmt: skip


def _attitude(ours: ForwardFlight, typed: ForwardFlight) -> Panel:
    sheet = SvgSheet("forward-attitude", height=2.8)
    with sheet as axes:
        for name, flight, style in (("corrected", ours, "-"), ("M_y as printed", typed, "--")):
            draw_angles(axes[0], flight.time, flight.q, style, f", {name}")
        axes[0].axhline(-PRINTED_NOSE, linestyle=":", linewidth=0.9, color="grey", label="-54, printed")
        axes[0].legend(ncols=3, fontsize=7)
    return Panel(
        "4.4", "Attitude under the non-linear forward law",
        "The pitch settles near -54 deg on a path of 45 deg: the difference is the incidence.",
        f"Corrected: nose {math.degrees(ours.nose[-1]):.1f} deg on a path of {math.degrees(ours.climb[-1]):.1f} deg; "
        f"with M_y as printed {math.degrees(typed.nose[-1]):.1f} and {math.degrees(typed.climb[-1]):.1f} deg. "
        f"{SEQUENCE}", sheet.svg,
    )  # fmt: skip


def _commands(ours: ForwardFlight, typed: ForwardFlight) -> Panel:
    sheet = SvgSheet("forward-commands", 2, height=2.0)
    with sheet as axes:
        for name, flight, style in (("corrected", ours, "-"), ("M_y as printed", typed, "--")):
            axes[0].plot(*thin(flight.time, flight.actuator[:, 0]), style, label=name)
            axes[1].plot(*thin(flight.time, np.degrees(flight.actuator[:, 2])), style, label=name)
        axes[0].axhline(PRINTED_MOTORS, linestyle=":", linewidth=0.8, color="grey", label="661, printed")
        axes[0].set_ylabel("motors [rad/s]")
        axes[1].set(xlabel="t [s]", ylabel="elevons [deg]")
        axes[0].legend()
        for axis in axes:
            axis.grid(alpha=0.2)
    typed_motor = typed.actuator[-1, 0]
    return Panel(
        "4.5", "Commands under the non-linear forward law",
        "The motors settle at 661 rad/s, close to the hover's speed.",
        f"Corrected {ours.actuator[-1, 0]:.0f}, with M_y as printed {typed_motor:.0f} rad/s at the end.",
        sheet.svg,
    )  # fmt: skip


def _lasting_error(a: Airframe) -> Panel:
    sheet = SvgSheet("forward-error", height=2.6)
    with sheet as axes:
        for swapped, style, word in ((0, "-", "corrected"), (1, "--", "M_y as printed")):
            axes[0].set_prop_cycle(None)
            for k_c in (1.0, 0.3, 0.05):
                flight = fly(
                    CLIMB_TARGET, ReportForwardGains(a, k_c=k_c, swapped=swapped), speed=CLIMB_SPEED, duration=30.0
                )
                off = np.degrees(np.maximum(flight.angle_off, 1e-6))
                axes[0].semilogy(*thin(flight.time, off), style, label=f"{word}, k_c = {k_c:g}")
        axes[0].set(xlabel="t [s]", ylabel="velocity off the line of sight [deg]", ylim=(1e-3, 90.0))
        axes[0].legend(fontsize=7, ncols=2)
        axes[0].grid(alpha=0.2)
    return Panel(
        "", "Error to the line of sight, in both readings of M_y", "The velocity converges to the line of sight.",
        "Only with the corrected M_y. As typed, an error stays that grows as the gain k_c shrinks.", sheet.svg,
    )  # fmt: skip


VERTICAL_PLANE = Experiment(
    "vertical-plane",
    "Forward flight in the vertical plane",
    "4.2",
    "The report's line-of-sight law flies from 10 m/s, level, towards [1000, 0, 1000] at 20 m/s. It prints no gains, "
    "so its two numbers, 54 deg and 661 rad/s, are tested on what no gain changes: the steady climb. The flights show "
    "the law with its M_y corrected and as printed; the Jacobian in the report's public source code has it right.",
    run,
)
