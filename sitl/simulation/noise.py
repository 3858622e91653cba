"""Random draws of a flight, by its seed: the gusts' and the sensors' from streams of their own."""

from __future__ import annotations

import numpy as np

from sitl.model.airframe import Array
from sitl.sensors.draws import in_fine_steps

BLOCK = 5000  # control periods drawn at once
SWIRLS = 4  # draws of a wind field in a period


class Draws:
    """Unit normals, a row per control period; the gusts' are drawn only where there are gusts."""

    def __init__(self, seed: int) -> None:
        self._gusts = np.random.default_rng(seed)
        self._sensors = np.random.default_rng((seed, 1))  # apart, so that sensors do not change the gusts
        self._gust_rows, self._sensor_rows = np.zeros((0, 3)), np.zeros((0, 5))
        self._swirls = np.random.default_rng((seed, 4))  # 2 and 3 are those of the avionics
        self._swirl_rows = np.zeros((0, SWIRLS))
        self._gust_block = self._sensor_block = self._swirl_block = -1

    def rows(self, period: int, *, gusts: bool) -> tuple[Array, Array]:
        """Draws from a period on to the end of its block: of the gusts, (n, 3) or none, and the sensors, (n, 5).

        Args:
            period: The first control period; never before that of an earlier call's block.
            gusts: Whether there are gusts.
        """
        block, row = divmod(period, BLOCK)
        while self._sensor_block < block:
            self._sensor_rows = self._sensors.standard_normal((BLOCK, 5))
            self._sensor_block += 1
        while gusts and self._gust_block < block:
            self._gust_rows = self._gusts.standard_normal((BLOCK, 3))
            self._gust_block += 1
        return (self._gust_rows[row:] if gusts else _NO_GUSTS), self._sensor_rows[row:]

    def swirl_rows(self, period: int) -> Array:
        """Draws of a wind field from a period on to the end of its block, (n, 4)."""
        block, row = divmod(period, BLOCK)
        while self._swirl_block < block:
            self._swirl_rows = in_fine_steps(self._swirls.standard_normal((BLOCK, SWIRLS)))
            self._swirl_block += 1
        return self._swirl_rows[row:]


_NO_GUSTS = np.zeros((0, 3))
