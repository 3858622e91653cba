"""nu against nu' (report, appendix D): on the plain quadrotor, where the law's model is exact, and on the vehicle."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sitl import PERIOD, Array, Quaternion, Vector
from sitl.control.governor import LINEAR
from sitl.control.hover_zero_moment import ZeroMomentGains
from sitl.design.gains import zero_moment_gains
from sitl.lab.reproduction.equations import quadrotor
from sitl.lab.reproduction.equations.quadrotor import QUADROTOR, QuadrotorFlight, force_errors, quadrotor_gains
from sitl.lab.reproduction.experiment import (
    REPORT_SET,
    Conditions,
    Experiment,
    ExperimentResult,
    Illustration,
    Panel,
    Statement,
    above,
    below,
)
from sitl.lab.reproduction.flight_panels import SvgSheet, thin
from sitl.lab.scenarios import SCENARIOS, Track, fly, settling_time
from sitl.model.quaternions import from_euler

LIFT_TARGET = (1.0, 1.0, 1.0)  # near enough that no thrust reaches its limit [m]
K_DELTA = 5.0  # [1/s]
NU_VARIANTS = ("nu", "nu'")


class LadderGains(NamedTuple):
    """Gains of one flight of the vehicle."""

    k_pp: float  # [N/m]
    k_pd: float  # [N s/m]
    k_delta: float  # [1/s]
    lam: float  # attitude bandwidth [rad/s]


GAIN_LADDER = (
    LadderGains(1.0, 1.0, 5.0, 8.0),
    LadderGains(1.5, 1.5, 5.0, 10.0),
    LadderGains(2.0, 2.0, 8.0, 14.0),
    LadderGains(3.0, 3.0, 8.0, 14.0),
    LadderGains(4.0, 3.5, 10.0, 18.0),
)


def lift(*, nu_prime: bool, duration: float) -> QuadrotorFlight:
    """Fly the quadrotor from rest, tilted by 20 deg, to the target."""
    tilted, upright = from_euler(math.radians(20.0), math.radians(-10.0), 0.0), Quaternion(1.0, 0.0, 0.0, 0.0)
    gains = quadrotor_gains(nu_prime=nu_prime)
    return quadrotor.fly(tilted, Vector(*LIFT_TARGET), upright, gains, QUADROTOR, round(duration / PERIOD))


def lag_error(flight: QuadrotorFlight) -> float:
    """Largest distance of f_delta from a first-order lag with k_delta, over its first value [-]."""
    lag = flight.f_delta[0] * np.exp(-K_DELTA * flight.time)[:, None]
    return float(np.linalg.norm(flight.f_delta - lag, axis=1).max() / np.linalg.norm(flight.f_delta[0]))


def _settled(flight: QuadrotorFlight) -> float:
    """Time after which the quadrotor stays within 0.05 m [s]."""
    outside = np.flatnonzero(np.linalg.norm(flight.position - LIFT_TARGET, axis=1) > 0.05)
    return float(flight.time[outside[-1]])


def force_error(track: Track, gains: ZeroMomentGains) -> Array:
    """|f_delta| = |R(q_d) d f - f_r| over a flight of the vehicle, (n,) [N]."""
    v, pointing = np.ascontiguousarray(track.v), np.ascontiguousarray(track.pointing)
    return force_errors(track.p - track.target, v, pointing, SCENARIOS["hover"].speed, gains)


def vehicle_flight(conditions: Conditions, gains: LadderGains, *, nu_prime: bool) -> Track:
    """The hover flight to [5, 5, 5] with some gains."""
    hover = SCENARIOS["hover"]
    tuning = hover.tuning._replace(
        kpp=gains.k_pp, kpd=gains.k_pd, k_delta=gains.k_delta, lam=gains.lam, nu_prime=int(nu_prime)
    )
    scenario = replace(hover, tuning=tuning, duration=15.0)
    return fly(scenario, seed=conditions.seed, airframe=conditions.airframe(REPORT_SET), keep_diverged=True)


def run(conditions: Conditions) -> ExperimentResult:
    """Figures D.1 and D.2, and the same on the vehicle with gains of increasing bandwidth."""
    lifts = [lift(nu_prime=prime, duration=8.0) for prime in (False, True)]
    tracks = [vehicle_flight(conditions, GAIN_LADDER[1], nu_prime=prime) for prime in (False, True)]
    apart = float(np.linalg.norm(lifts[0].position - lifts[1].position, axis=1).max())
    settled = [_settled(flight) for flight in lifts]
    lags = [lag_error(flight) for flight in lifts]
    statements = [
        Statement("appendix D", "quadrotor, nu': f_delta off a first-order lag, share of its first value",
                  below(0.01, "first order"), lags[1], note="compared to the per cent: the law acts once every 2 ms"),
        Statement("appendix D", "quadrotor, nu: f_delta off a first-order lag, share of its first value",
                  above(0.01, "not first order"), lags[0]),
    ]  # fmt: skip
    illustrations = [
        Illustration("appendix D", "quadrotor: nu' settles later by", settled[1] - settled[0], "s", "both the same way",
                     f"nu / nu' settle after {settled[0]:.2f} / {settled[1]:.2f} s, never more than {apart:.2f} m "
                     "apart; the report prints no gains and no quadrotor"),
        *_ladder(conditions),
    ]  # fmt: skip
    gains = zero_moment_gains(conditions.airframe(REPORT_SET), governor=LINEAR)
    return ExperimentResult(
        statements, [_positions(lifts, tracks, apart), _forces(lifts, tracks, lags, gains)], illustrations
    )


def _ladder(conditions: Conditions) -> list[Illustration]:
    illustrations = []
    for rung in GAIN_LADDER:
        settled = [settling_time(vehicle_flight(conditions, rung, nu_prime=prime), 0.05) for prime in (False, True)]
        gains = "k_pp {:g}, k_pd {:g}, k_delta {:g}, lambda {:g}".format(*rung)
        text = " / ".join("never" if math.isnan(time) else f"{time:.2f} s" for time in settled)
        illustrations.append(
            Illustration("appendix D", f"vehicle, {gains}: nu' settles later by", settled[1] - settled[0], "s",
                         "both the same way", f"nu / nu' settle after {text}; the report prints no gains")
        )  # fmt: skip
    return illustrations


def _positions(lifts: list[QuadrotorFlight], tracks: list[Track], apart: float) -> Panel:
    sheet = SvgSheet("nu-position", 2, height=2.2, share=False)
    with sheet as axes:
        for style, name, flight, track in zip("-:", NU_VARIANTS, lifts, tracks, strict=True):
            for axis, time, p in ((axes[0], flight.time, flight.position), (axes[1], track.time, track.p)):
                axis.set_prop_cycle(None)
                axis.plot(
                    *thin(time, p), style, label=[f"{axis_name}, {name}" for axis_name in ("north", "west", "up")]
                )
        for axis, what in zip(axes, ("quadrotor [m]", "DarkO [m]"), strict=True):
            axis.set_ylabel(what)
            axis.legend(ncols=2)
            axis.grid(alpha=0.2)
        axes[1].set_xlabel("t [s]")
    return Panel(
        "D.1", "Simulations with the redefined nu: position", "Both controllers converge the same way.",
        f"On the quadrotor they stay within {apart:.2f} m of each other. On DarkO they do at moderate gains; "
        "nu' reaches its limit first.", sheet.svg,
    )  # fmt: skip


def _forces(lifts: list[QuadrotorFlight], tracks: list[Track], lags: list[float], gains: ZeroMomentGains) -> Panel:
    sheet = SvgSheet("nu-force", 2, height=2.2, share=False)
    with sheet as axes:
        for name, flight, track in zip(NU_VARIANTS, lifts, tracks, strict=True):
            axes[0].semilogy(*thin(flight.time, np.linalg.norm(flight.f_delta, axis=1)), label=name)
            axes[1].semilogy(*thin(track.time, force_error(track, gains)), label=name)
        time = lifts[0].time
        start = float(np.linalg.norm(lifts[0].f_delta[0]))
        axes[0].semilogy(*thin(time, start * np.exp(-K_DELTA * time)), ":", label="first order")
        for axis, what in zip(axes, ("quadrotor |f_delta| [N]", "DarkO |f_delta| [N]"), strict=True):
            axis.set_ylabel(what)
            axis.set_ylim(1e-4, 20.0)
            axis.legend()
            axis.grid(alpha=0.2)
        axes[1].set_xlabel("t [s]")
    return Panel(
        "D.2", "Simulations with the redefined nu: dynamics of f_delta", "nu' makes f_delta a first-order lag.",
        f"On the quadrotor nu' follows the lag within {100 * lags[1]:.1f} % of its first value, nu is off by "
        f"{100 * lags[0]:.0f} %. On DarkO neither is a lag: the airspeed and the elevons' side force, which the law "
        "does not know, accelerate the vehicle and so move f_r.", sheet.svg,
    )  # fmt: skip


NU_REDEFINITION = Experiment(
    "nu",
    "nu against nu'",
    "appendix D",
    "Appendix D redefines nu so that the force error f_delta decays as a first-order lag, and finds that both "
    "converge the same way. Flown on a plain quadrotor, for which the law was written, and on the vehicle.",
    run,
)
