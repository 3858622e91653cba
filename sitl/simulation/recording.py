"""Recording of a flight: jumps as they are reported, samples as arrays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from protocol.dialect.vocabulary import Law, Reason
from sitl.model.airframe import Array
from sitl.sensors.draws import PERIOD
from sitl.simulation.dispatch import Register


class JumpRecord(NamedTuple):
    """One jump of the vehicle, as it is reported."""

    time: float  # ordinary time t [s]
    number: int  # j after the jump
    source: Law
    target: Law
    name: str
    reason: Reason
    v: float  # of the linear forward law where the jump is to or from it, else of the linear hover law


def jump_of(entry: Any, number: int, register: Register) -> JumpRecord:  # noqa: ANN401 - a numpy record
    """A jump as the loop noted it, in words."""
    source, target = register.law(int(entry["source"])), register.law(int(entry["target"]))
    jump = register.table[source][int(entry["row"])]
    forward = Law.FORWARD_LINEAR in {source, target}
    value = float(entry["v_forward" if forward else "v_hover"])
    return JumpRecord(
        time=int(entry["periods"]) * PERIOD,
        number=number,
        source=source,
        target=target,
        name=jump.name,
        reason=jump.reason,
        v=value,
    )


class EnergyByLaw(dict[Any, float]):
    """Shaft energy that each law has used [J], by law."""

    def __init__(self, laws: Iterable[Law]) -> None:
        super().__init__(dict.fromkeys(laws, 0.0))
        self._total = 0.0

    def add(self, law: int, total: float) -> None:
        """All energy used since the last call, of which ``total`` is the sum so far, was this law's."""
        if law in self:
            self[law] += total - self._total
        self._total = total


@dataclass(frozen=True)
class Recording:
    """Samples of a flight, one row each, and its jumps."""

    time: Array  # (n,) [s]
    position: Array  # (n, 3) world NWU [m]
    velocity: Array  # (n, 3) world NWU [m/s]
    attitude: Array  # (n, 4) body FLU to world NWU
    rates: Array  # (n, 3) body FLU [rad/s]
    actuators: Array  # (n, 4) w1, w2 [rad/s], d1, d2 [rad]
    law: npt.NDArray[np.int64]  # (n,) DARKO_LAW
    v_hover: Array  # (n,) V of the linear hover law about the reference
    energy: Array  # (n,) at the shafts [J]
    wind: Array  # (n, 3) as estimated, world NWU [m/s]
    pointing: Array  # (n, 5) attitude and force [N] the zero-moment law steers; stale while another law flies
    reference: Array  # (n, 3) position asked for, world NWU [m]
    jumps: tuple[JumpRecord, ...]

    @classmethod
    def of(cls, samples: npt.NDArray[Any], jumps: tuple[JumpRecord, ...]) -> Recording:
        """The arrays of recorded samples."""
        body, pointing = samples["body"], samples["pointing"]
        return cls(
            time=samples["periods"] * PERIOD,
            position=columns(body["position"]),
            velocity=columns(body["velocity"]),
            attitude=columns(body["attitude"]),
            rates=columns(body["rates"]),
            actuators=columns(samples["actuators"]),
            law=samples["law"].copy(),
            v_hover=samples["v_hover"].copy(),
            energy=samples["energy"].copy(),
            wind=columns(samples["wind"]),
            pointing=np.column_stack((columns(pointing["attitude"]), pointing["force"])),
            reference=columns(samples["reference"]),
            jumps=jumps,
        )


def columns(records: npt.NDArray[Any]) -> Array:
    """Records of floats as an array with a column per field."""
    names = records.dtype.names or ()
    return np.stack([records[name] for name in names], axis=-1)
