"""When the vehicle was armed, took off and landed: what FLIGHT_INFORMATION tells."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class FlightRecord:
    """When the present flight, or else the last one, was armed, took off and landed [s since boot]; 0: not yet.

    Call ``at`` with every picture; a flight is what happens between two armings.
    """

    number: int = 0  # of armings since boot
    armed_at: float = 0.0
    took_off_at: float = 0.0
    landed_at: float = 0.0
    armed: bool = False
    landed: bool = True

    def at(self, time: float, *, armed: bool, landed: bool) -> FlightRecord:
        """The record once the vehicle is seen so."""
        if (armed, landed) == (self.armed, self.landed):
            return self
        record = self
        if armed and not self.armed:
            record = FlightRecord(self.number + 1, armed_at=time, landed=self.landed)
        if self.landed and not landed:
            record = replace(record, took_off_at=time, landed_at=0.0)
        elif landed and not self.landed:
            record = replace(record, landed_at=time)
        return replace(record, armed=armed, landed=landed)
