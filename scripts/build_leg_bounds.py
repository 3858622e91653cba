"""Write ``protocol/flight_log/leg_bounds.toml``, the bounds beside which reports of logs set flown legs.

Run by hand: ``python scripts/build_leg_bounds.py``. Answers that
``darko-sitl optimal table`` has kept are taken; the others are found, which takes a minute each.
"""

import math
import sys
from pathlib import Path

from protocol.flight_log.leg_bounds import AHEAD, AIRFRAME, ASIDE, BEHIND
from sitl.lab.optimal.bound import find_bound
from sitl.lab.optimal.yardstick import DISTANCES, LEFT, ROW_KINDS, row_question

TABLE = Path(__file__).parents[1] / "protocol" / "flight_log" / "leg_bounds.toml"
KINDS = ("level", "up", "down", AHEAD, BEHIND, ASIDE)


def costs(kind: str) -> list[str]:
    """Lines of one kind of leg."""
    times, energies = [], []
    for distance in DISTANCES:
        leg = row_question(f"{kind}-{distance:g}", AIRFRAME)._replace(share_left=LEFT)
        quick, cheap = (find_bound(leg._replace(time_price=price)) for price in (math.inf, 0.0))
        for bound in (quick, cheap):
            if not bound.agrees:
                what = f"{bound.question.title()}, {bound.question.goal()}"
                print(f"{what}: guesses or meshes differ by more than 1 %, the best course is taken", file=sys.stderr)
        times.append(round(quick.time, 3))
        energies.append(round(cheap.energy, 1))
    return [f"[{kind}]", f"time = {times} # [s]", f"energy = {energies} # [J]", ""]


def main() -> None:
    """Find all bounds, then write the table."""
    lines = [
        f"# Bounds of {AIRFRAME}, hover to hover, {LEFT:.0%} of the actuators left, by scripts/build_leg_bounds.py.",
        "",
        f"distances = {list(DISTANCES)} # [m]",
        f"climb = {ROW_KINDS['up']['climb']} # of up and down [m]",
        f"wind = {ROW_KINDS[BEHIND]['tail_wind']} # [m/s]",
        "",
    ]
    lines += [line for kind in KINDS for line in costs(kind)]
    TABLE.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")
    print(f"wrote {TABLE}")


if __name__ == "__main__":
    main()
