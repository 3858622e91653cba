"""Times of arming, take-off and landing, for FLIGHT_INFORMATION."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class FlightTimes:
    """Times of arming, take-off and landing of the present or last flight [s since boot]; 0: not yet.

    A flight begins with an arming and lasts until the next one. Call ``updated`` whenever the vehicle may have changed.
    """

    number: int = 0  # armings since boot
    armed_at: float = 0.0
    took_off_at: float = 0.0
    landed_at: float = 0.0
    armed: bool = False
    landed: bool = True

    def updated(self, time: float, *, armed: bool, landed: bool) -> FlightTimes:
        """The times once the vehicle is armed and landed, or not.

        Args:
            time: Now [s since boot].
            armed: Whether it is armed.
            landed: Whether it stands on the ground.
        """
        if (armed, landed) == (self.armed, self.landed):
            return self
        times = self
        if armed and not self.armed:
            times = FlightTimes(self.number + 1, armed_at=time, landed=self.landed)
        if self.landed and not landed:
            times = replace(times, took_off_at=time, landed_at=0.0)
        elif landed and not self.landed:
            times = replace(times, landed_at=time)
        return replace(times, armed=armed, landed=landed)
