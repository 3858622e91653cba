r"""Propellers: TOML files of measured coefficients, and the quadratics in the advance ratio that the kernels fly.

.. math::
    C_T \approx t_0 + t_1 J + t_2 J |J|, \quad
    C_P \approx p_0 + p_1 J + p_2 J |J| + p_3 \max(J - J_b, 0)^2

The fits hold beyond the tables too, where air turns the propeller or comes from behind: they are refused if they
give more thrust power than shaft power at any advance ratio.

A propeller measured on a bench over its speeds has its thrust at rest from there, a w^2 + b w: blades of a few
centimetres lift less where they are slow.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sitl.errors import SitlError
from sitl.model.airframe import Array

MAX_MISFIT = 0.006  # of a coefficient
FIT_DIGITS = 6  # of a fitted coefficient: the last bits of a least-squares fit depend on the processor
BENCH_DENSITY = 1.225  # of the air on a bench that does not tell it [kg/m3]
ADVANCE_RATIOS = np.linspace(-20.0, 20.0, 8001)  # where the energy is looked at; beyond, the highest powers decide


class PropellerError(SitlError):
    """A propeller cannot be used; the message names file and value."""


class PropellerFactors(NamedTuple):
    """Factors of a propeller against its table, identified from a flight."""

    thrust_factor: float = 1.0  # of all thrust
    torque_factor: float = 1.0  # of all torque
    advance_factor: float = 1.0  # of the advance ratio that its blades feel
    disc_factor: float = 1.0  # of the disc that its slipstream comes from


@dataclass(frozen=True)
class Propeller:
    """A measured propeller."""

    name: str
    description: str
    source: str
    diameter: float  # [m]
    bend: float  # advance ratio where the torque's fit bends [-]
    table: Array  # rows of J, C_T, C_P; (n, 3)
    thrust_fit: Array  # t_0, t_1, t_2
    power_fit: Array  # p_0 ... p_3
    slow_loss: float = 0.0  # b of the bench, negative, in air of BENCH_DENSITY [N s/rad]
    turns: float = math.inf  # of which the table is [1/s]

    @property
    def disc(self) -> float:
        """Area of its disc [m2]."""
        return 0.25 * math.pi * self.diameter**2

    def corrected(self, factors: PropellerFactors) -> Propeller:
        """The propeller with other coefficients and the disc as it is.

        Raises:
            PropellerError: It would give more thrust power than shaft power at some advance ratio.
        """
        by_advance = factors.advance_factor ** np.array([0.0, 1.0, 2.0, 2.0])
        after = replace(
            self,
            thrust_fit=factors.thrust_factor * by_advance[:3] * self.thrust_fit,
            power_fit=factors.torque_factor * by_advance * self.power_fit,
            bend=self.bend / factors.advance_factor,
            slow_loss=factors.thrust_factor * self.slow_loss,
        )
        _check_energy(after)
        return after

    def coefficients(self, J: Array, turns: float | None = None) -> tuple[Array, Array]:
        """C_T and C_P of the fits at advance ratios, of any shape, and revolutions per second, else the table's."""
        t, p = self.thrust_fit, self.power_fit
        square = J * np.abs(J)
        lost = 2.0 * math.pi * self.slow_loss / (BENCH_DENSITY * self.diameter**4 * (turns or self.turns))
        return t[0] + lost + t[1] * J + t[2] * square, (
            p[0] + p[1] * J + p[2] * square + p[3] * np.maximum(J - self.bend, 0.0) ** 2
        )

    def constants(self, rho: float) -> dict[str, float]:
        """The airframe's constants in air of a density [kg/m3]."""
        D, turn = self.diameter, 2.0 * math.pi
        (t0, t1, t2), (p0, p1, p2, p3) = self.thrust_fit.tolist(), self.power_fit.tolist()
        return {
            "k_f": rho * D**4 * t0 / turn**2,
            "k_fv": rho * D**3 * t1 / turn,
            "k_fvv": rho * D**2 * t2,
            "k_fw": rho / BENCH_DENSITY * self.slow_loss,
            "k_m": rho * D**5 * p0 / turn**3,
            "k_mv": rho * D**4 * p1 / turn**2,
            "k_mvv": rho * D**3 * p2 / turn,
            "k_mk": rho * D**3 * p3 / turn,
            "advance_knot": self.bend * D / turn,
        }


def available_propellers() -> list[str]:
    """Names of the shipped propellers."""
    entries = files("sitl.model.propellers").iterdir()
    return sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml"))


def load_propeller(name_or_path: str) -> Propeller:
    """Load a shipped propeller by name, or a TOML file by path.

    Raises:
        PropellerError: There is no such propeller, its table is not valid, or its fits are wrong.
    """
    return propeller_of(name_or_path, read_propeller(name_or_path))


def read_propeller(name_or_path: str) -> dict[str, Any]:
    """The table of a shipped propeller, or of a TOML file, as it is written.

    Raises:
        PropellerError: There is no such propeller, or the file cannot be read.
    """
    path = Path(name_or_path)
    if path.suffix != ".toml":
        if name_or_path not in available_propellers():
            known = ", ".join(available_propellers())
            raise PropellerError(f"no propeller {name_or_path!r}: there are {known}; a file's name ends in .toml")
        path = Path(str(files("sitl.model.propellers") / f"{name_or_path}.toml"))
    try:
        return tomllib.loads(path.read_text("utf-8-sig"))
    except OSError as error:
        raise PropellerError(f"propeller {path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeError) as error:
        raise PropellerError(f"propeller {path}: not a TOML file: {error}") from error


def propeller_of(name: str, raw: dict[str, Any]) -> Propeller:
    """The propeller of a table as read from TOML.

    Raises:
        PropellerError: The table is not valid, or its fits are wrong.
    """
    try:
        header, measured, assumed = raw["propeller"], raw["measured"], raw.get("assumed", {"rows": [], "source": ""})
        diameter, bend = float(header["diameter"]), float(header["bend"])
        table = np.array([*assumed["rows"], *measured["rows"]], float).reshape(-1, 3)
        source = "; ".join(text for text in (measured["source"], assumed["source"]) if text)
        description = str(header["description"])
    except (KeyError, TypeError, ValueError) as error:
        raise PropellerError(f"propeller {name}: not a table of J, C_T and C_P: {error}") from error
    if not np.isfinite(table).all() or len(table) < 5 or diameter <= 0.0:
        raise PropellerError(f"propeller {name}: takes a diameter and five finite rows or more")
    J = table[:, 0]
    rise = np.stack([np.ones_like(J), J, J * np.abs(J), np.maximum(J - bend, 0.0) ** 2], axis=1)
    made = Propeller(
        name=name,
        description=description,
        source=source,
        diameter=diameter,
        bend=bend,
        table=table,
        thrust_fit=_fitted(rise[:, :3], table[:, 1]),
        power_fit=_fitted(rise, table[:, 2]),
    )
    _check(made)
    return _benched(made, raw["bench"]) if "bench" in raw else made


def _benched(made: Propeller, bench: dict[str, Any]) -> Propeller:
    """The propeller with the thrust at rest of a bench: rows of rpm and newton, fitted in relative error."""
    try:
        speed, T = np.array(bench["rows"], float).reshape(-1, 2).T
        table_speed = float(bench["table_rpm"])
    except (KeyError, TypeError, ValueError) as error:
        raise PropellerError(
            f"propeller {made.name}: not a bench of rpm and newton, and its table_rpm: {error}"
        ) from error
    if len(T) < 3 or not (np.isfinite(speed).all() and np.isfinite(T).all() and (T > 0.0).all()):
        raise PropellerError(f"propeller {made.name}: takes three finite rows of the bench or more")
    turns = speed / 60.0
    unit = BENCH_DENSITY * made.diameter**4
    rise = np.stack([unit * turns**2, unit * turns], axis=1) / T[:, None]
    static, slow = _fitted(rise, np.ones_like(T)).tolist()
    loss = unit * slow / (2.0 * math.pi)
    J, C_T, _ = made.table.T
    at_rest = static + slow * 60.0 / table_speed
    by_inflow = _fitted(np.stack([J, J * np.abs(J)], axis=1), C_T - at_rest)
    benched = replace(made, thrust_fit=np.array([static, *by_inflow]), slow_loss=loss, turns=table_speed / 60.0)
    _check(benched)
    return benched


def _fitted(rise: Array, values: Array) -> Array:
    """Coefficients of least squares, rounded, (k,)."""
    return np.array([round(float(one), FIT_DIGITS) for one in np.linalg.lstsq(rise, values, rcond=None)[0]])


def _check(propeller: Propeller) -> None:
    J, C_T, C_P = propeller.table.T
    misfit = max(
        float(np.abs(fit - told).max()) for fit, told in zip(propeller.coefficients(J), (C_T, C_P), strict=True)
    )
    if misfit > MAX_MISFIT:
        raise PropellerError(f"propeller {propeller.name}: the fit misses the table by {misfit:.4f}")
    _check_energy(propeller)


def _check_energy(propeller: Propeller) -> None:
    C_T, C_P = propeller.coefficients(ADVANCE_RATIOS, math.inf)
    gained = ADVANCE_RATIOS * C_T - C_P
    if gained.max() > 0.0 or not propeller.thrust_fit[2] < 0.0:
        worst = float(ADVANCE_RATIOS[int(gained.argmax())])
        raise PropellerError(f"propeller {propeller.name}: more thrust power than shaft power at J = {worst:.2f}")
