"""The question that a bound answers, and the folder that keeps answers by the hash of their question."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Any, NamedTuple

from platformdirs import user_cache_path

from protocol.errors import FileError
from protocol.tools.files import write_atomically
from sitl import SitlError, Vector, load_airframe
from sitl.enclosure.arena_files import load_arena

HOVER_END, CRUISE_END, POINT_END = "hover", "cruise", "point"  # at an end: a pose, a cruise, or a hover of any heading
MAX_LEG, MAX_LEG_CLIMB, MAX_LEG_WIND = 1000.0, 300.0, 10.0  # [m], [m], [m/s]
SLOWEST_CRUISE, FASTEST_CRUISE = 3.0, 25.0  # through the air [m/s]
HERE = Path(__file__).parent
ANSWERING = ("symbols.py", "collocation.py", "leg_problem.py", "bound.py", "../../model/*.py")  # what an answer is by


class Question(NamedTuple):
    """A leg to the north, and what of it is to be least."""

    airframe: str = "darko"  # parameter set or TOML file
    distance: float = 100.0  # [m]
    climb: float = 0.0  # [m]
    turn: float = 0.0  # from the heading at the start to north, to the left [rad]
    tail_wind: float = 0.0  # [m/s]
    cross_wind: float = 0.0  # from the right, towards west [m/s]
    start: str = HOVER_END  # or CRUISE_END
    end: str = HOVER_END  # or CRUISE_END, POINT_END
    airspeed: float = 15.0  # of a cruise at an end [m/s]
    time_price: float = math.inf  # energy that a second may cost [W]; 0: least energy, infinite: least time
    room: tuple[float, float] = (1.0, 8.0)  # below the lower and above the higher end [m]
    nose: tuple[float, float] = (-60.0, 150.0)  # elevation, above 90 on its back [deg]
    sideways: float = 6.0  # air along the wing at most: the plates of the model have no drag there, so they glide [m/s]
    share_left: float = 0.0  # of the actuators' ranges and rates, for feedback
    arena: str = ""  # name or file; empty: none
    place: tuple[float, float, float] = (0.0, 0.0, 50.0)  # of the start, world NWU [m]
    in_space: bool = False  # three dimensions also where the leg lies in a plane

    @property
    def wind(self) -> Vector:
        """Velocity of the air, world NWU [m/s]."""
        return Vector(self.tail_wind, self.cross_wind, 0.0)

    @property
    def is_planar(self) -> bool:
        """Whether it may be flown in a vertical plane, left and right alike."""
        return not (self.in_space or self.turn or self.cross_wind or self.arena)

    def check(self) -> None:
        """Refuse what cannot be asked.

        Raises:
            SitlError: Names the value and its range.
        """
        ranges = {
            "distance": (self.distance, 0.0, MAX_LEG, "m"),
            "climb": (self.climb, -MAX_LEG_CLIMB, MAX_LEG_CLIMB, "m"),
            "wind": (math.hypot(self.tail_wind, self.cross_wind), 0.0, MAX_LEG_WIND, "m/s"),
            "airspeed": (self.airspeed, SLOWEST_CRUISE, FASTEST_CRUISE, "m/s"),
            "air from the side": (self.sideways, max(abs(self.cross_wind), 0.5), FASTEST_CRUISE, "m/s"),
            "share left": (self.share_left, 0.0, 0.8, ""),
            "time's price": (self.time_price, 0.0, math.inf, "W"),
        }
        for name, (value, low, high, unit) in ranges.items():
            if not low <= value <= high:
                raise SitlError(f"{name} {value:g} is not from {low:g} to {high:g} {unit}".rstrip())
        if min(self.room) < 0.0:
            raise SitlError(f"room of {self.room[0]:g} m below and {self.room[1]:g} m above: neither may be negative")
        if not -90.0 <= self.nose[0] < 0.0 or not 90.0 < self.nose[1] <= 180.0:
            raise SitlError(
                f"nose from {self.nose[0]:g} to {self.nose[1]:g} deg: from -90 to below 0, and from above 90 to 180"
            )
        if self.distance == 0.0 and self.climb == 0.0 and self.start == self.end != CRUISE_END and self.turn == 0.0:
            raise SitlError("the leg ends where and as it begins")

    def title(self) -> str:
        """The leg in words."""
        words = [f"{self.distance:g} m"]
        words += [f"climb {self.climb:+g} m"] if self.climb else []
        words += [f"turned {math.degrees(self.turn):.0f} deg"] if self.turn else []
        words += [f"wind {self.tail_wind:+g} m/s along"] if self.tail_wind else []
        words += [f"wind {self.cross_wind:+g} m/s across"] if self.cross_wind else []
        words += [f"{self.start} to {self.end}"] if (self.start, self.end) != (HOVER_END, HOVER_END) else []
        words += [f"in {self.arena}"] if self.arena else []
        return ", ".join(words)

    def goal(self) -> str:
        """The cost in words."""
        left = f", {self.share_left:.0%} of the actuators left" if self.share_left else ""
        if math.isinf(self.time_price):
            return f"least time{left}"
        return (
            f"least energy{left}" if self.time_price == 0.0 else f"least energy + {self.time_price:g} W of time{left}"
        )

    def key(self) -> str:
        """Hash of the question, of the airframe's and the arena's values, and of the sources that answer it."""
        values = {
            "question": self._asdict(),
            "airframe": load_airframe(self.airframe).parameters._asdict(),
            "arena": repr(load_arena(self.arena)) if self.arena else "",
        }
        digest = hashlib.sha256(json.dumps(values, sort_keys=True).encode())
        for path in sorted(path for pattern in ANSWERING for path in HERE.glob(pattern)):
            digest.update(path.read_bytes())
        return digest.hexdigest()[:20]


class AnswerFolder:
    """Kept answers, a JSON file each.

    Args:
        folder: By default that of the user's cache.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder or Path(user_cache_path("darko")) / "optimal"

    def find(self, question: Question) -> dict[str, Any] | None:
        """The answer to a question; None if there is none, or what is there cannot be read."""
        try:
            found = json.loads((self.folder / f"{question.key()}.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) else None

    def keep(self, question: Question, answer: dict[str, Any]) -> None:
        """Write an answer beside its place and put it there whole.

        Raises:
            SitlError: The folder cannot be written; the message names it.
        """
        path = self.folder / f"{question.key()}.json"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_atomically(path, json.dumps(answer).encode())
        except (OSError, FileError) as error:
            raise SitlError(f"the answer is not kept: {error}") from error
