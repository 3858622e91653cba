"""Results of the study of the region of attraction, made up."""

import numpy as np

from sitl.design.lqr import hover_gains
from sitl.lab.proofs.region import Certificate
from sitl.lab.studies.hover_region import LawRegion
from sitl.lab.studies.hover_region_flights import V_BANDS, RegionFlights
from sitl.model.airframe_files import load

NOMINAL = load("nominal").parameters


def flights_of(start, converged):
    """Flights that start at these values of V, and whether each converges."""
    n = len(start)
    band = np.searchsorted(V_BANDS, start, side="right") - 1
    yes, no = np.ones(n, dtype=bool), np.zeros(n)
    return RegionFlights(np.array(start, dtype=float), band, yes, np.array(converged, dtype=bool), yes, no, no)


def made_up_results():
    """Two laws, one of them with a certificate."""
    flights = flights_of(np.arange(1.0, 400.0), np.arange(1.0, 400.0) < 100.0)
    settling = np.full((5, 3), 3.0)
    certificate = Certificate(0.02, 0.06, 0.1, 36.0, 0.86)
    shared = {"guaranteed": 0.3, "settling": settling, "flown": flights, "spread": flights}
    return [
        LawRegion(name="LQI as flown", gains=hover_gains(NOMINAL), certificate=None, rise=0.05, seen=0.6, **shared),
        LawRegion(name="LQR", gains=hover_gains(NOMINAL, integral=False), certificate=certificate, rise=0.047, seen=0.9,
                  **shared),
    ]  # fmt: skip
