"""Tuning of the wind estimator."""

from __future__ import annotations

from sitl.control.wind_estimator import WindGains


def wind_gains() -> WindGains:
    """It follows a gust within some 0.2 s in cruise."""
    return WindGains(
        walk=1.0,
        return_time=300.0,
        normal_noise=1.0,
        pitot_noise=0.2,
        axial_time=8.0,
        min_pitot=4.0,
        max_deviation=3.0,
    )
