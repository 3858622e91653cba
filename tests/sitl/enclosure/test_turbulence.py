"""Dryden's turbulence: deviations, lengths and spectra of the specification."""

import math

import numpy as np
import pytest

from sitl.compiled import entry
from sitl.enclosure.turbulence import FOOT, Eddies, Scales, low_altitude, root, stirred, turbulence

SPAN, SPEED, DT = 0.55, 8.0, 0.01
SCALES = Scales(1.0, 1.5, 0.8, 6.0, 4.0, 3.0)


@entry
def _record(noise, eddies, scales, rows):
    for i in range(noise.shape[0]):
        draws = (noise[i, 0], noise[i, 1], noise[i, 2], noise[i, 3])
        eddies = stirred(eddies, draws, scales, SPEED, SPAN, DT)
        air = turbulence(eddies, scales, SPAN)
        v, w = air.velocity, air.rotation
        rows[i, 0], rows[i, 1], rows[i, 2] = v.x, v.y, v.z
        rows[i, 3], rows[i, 4], rows[i, 5] = w.x, w.y, w.z


@pytest.fixture(scope="module")
def flown():
    """A record of all six components, (n, 6)."""
    noise, rows = np.random.default_rng(3).standard_normal((100_000, 4)), np.empty((100_000, 6))
    _record(noise, Eddies(*(0.0,) * 8), SCALES, rows)
    return rows


def roll_deviation():
    """Of the specification's spectrum of p."""
    L = SCALES.length_up
    return SCALES.up * math.sqrt(0.8 * math.pi**2 / (8.0 * SPAN * L)) * (math.pi * L / (4.0 * SPAN)) ** (1.0 / 6.0)


def test_velocities_and_roll_have_the_deviation_asked_for(flown):
    wanted = (SCALES.along, SCALES.across, SCALES.up, roll_deviation())
    assert flown[:, :4].std(axis=0) == pytest.approx(wanted, rel=0.06)


@pytest.mark.parametrize("component", range(6))
def test_spectra(flown, component):
    """The measured density of each component, averaged over a band, against that of MIL-F-8785C."""
    w = np.fft.rfftfreq(2000, DT) * 2.0 * math.pi
    parts = flown[:, component].reshape(-1, 2000) * np.hanning(2000)
    measured = (
        (np.abs(np.fft.rfft(parts)) ** 2).mean(axis=0) * 2.0 * DT / (2.0 * math.pi * (np.hanning(2000) ** 2).sum())
    )
    sigma, length = SCALES[min(component, 2)], SCALES[3 + min(component, 2)]
    x = length * w / SPEED
    density = sigma**2 * length / (math.pi * SPEED) * (1.0 + 3.0 * x**2) / (1.0 + x**2) ** 2
    if component == 0:
        density = sigma**2 * 2.0 * length / (math.pi * SPEED) / (1.0 + x**2)
    if component >= 3:
        across, up = (
            s**2 * L / (math.pi * SPEED) * (1.0 + 3.0 * (L * w / SPEED) ** 2) / (1.0 + (L * w / SPEED) ** 2) ** 2
            for s, L in ((SCALES.across, SCALES.length_across), (SCALES.up, SCALES.length_up))
        )
        wide = 1.0 + (4.0 * SPAN * w / (math.pi * SPEED)) ** 2
        L = SCALES.length_up
        roll = SCALES.up**2 / (SPEED * L) * 0.8 * (math.pi * L / (4.0 * SPAN)) ** (1.0 / 3.0) / wide
        narrow = 1.0 + (3.0 * SPAN * w / (math.pi * SPEED)) ** 2
        density = (roll, (w / SPEED) ** 2 * up / wide, (w / SPEED) ** 2 * across / narrow)[component - 3]
    for low, high in ((0.5, 1.5), (1.5, 4.0), (4.0, 10.0), (10.0, 25.0)):
        band = (w > low) & (w < high)
        assert measured[band].mean() == pytest.approx(density[band].mean(), rel=0.2)


def test_low_altitude_has_the_specifications_lengths_and_deviations():
    """At 200 ft: L_w = h, L_u = h / (0.177 + 0.000823 h)^1.2, sigma_w = 0.1 W_20, sigma_u by the power 0.4."""
    scales = low_altitude(200.0 * FOOT, 15.0)
    fold = (0.177 + 0.000823 * 200.0) ** 0.4
    assert scales == pytest.approx(
        (1.5 / fold, 1.5 / fold, 1.5, 200.0 * FOOT / fold**3, 200.0 * FOOT / fold**3, 200.0 * FOOT)
    )
    assert low_altitude(1.0, 15.0) == low_altitude(10.0 * FOOT, 15.0)  # no further down


@pytest.mark.parametrize(("x", "degree"), [(0.4, 6), (1.0, 6), (214.0, 6), (0.177, 5), (1.0, 5)])
def test_roots(x, degree):
    assert root(x, degree) == pytest.approx(x ** (1.0 / degree), rel=1e-12)
