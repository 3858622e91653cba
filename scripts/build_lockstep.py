"""Draw the lockstep of ``darko-sitl physics`` with each autopilot: docs/physics-*.svg; ``--check`` compares.

``python -m scripts.build_lockstep``, from the project's folder. Ports are those that the links open.
"""

from __future__ import annotations

import argparse
import sys
from html import escape
from pathlib import Path
from typing import NamedTuple

from sitl.physics.ardupilot import FRAME_FORMATS, ArduPilotLink
from sitl.physics.betaflight import REPEAT_TIME, STATE, STATE_PORT, BetaflightLink
from sitl.physics.px4 import Px4Link

WIDTH, LEFT, RIGHT, TOP, ROW = 900, 130, 730, 64, 46
STYLE = """
  text { font: 14px sans-serif; fill: #1f2328; text-anchor: middle }
  .who { font-weight: bold } .small { font-size: 12px }
  line, path { stroke: #57606a; stroke-width: 1.5; fill: none } .box { fill: #ddf4ff; stroke: #0969da }
  .out { stroke: #bc4c00 } .in { stroke: #0969da } polygon { stroke: none } polygon.out { fill: #bc4c00 }
  polygon.in { fill: #0969da }
  @media (prefers-color-scheme: dark) { text { fill: #e6edf3 } .box { fill: #0c2d6b } line, path { stroke: #8b949e }
  .out { stroke: #f0883e } .in { stroke: #58a6ff } polygon.out { fill: #f0883e } polygon.in { fill: #58a6ff } }
"""


class Arrow(NamedTuple):
    """A packet: to the plant, or from it."""

    to_plant: bool
    words: str
    small: str = ""


class Work(NamedTuple):
    """Done by the plant before it answers."""

    words: str


class Picture(NamedTuple):
    """Two parties, and what goes between them in one step."""

    autopilot: str
    plant: str
    rows: tuple[Arrow | Work, ...]
    rate: str


_FLIES = Work("motors and elevons, then the plant at 1 kHz; instruments at 500 Hz")
_MAGIC = " or ".join(f"{magic} ({(layout.size - 8) // 2} outputs)" for magic, layout in FRAME_FORMATS.items())
PICTURES = {
    "ardupilot": Picture(
        "ArduPlane, SITL",
        f"darko-sitl physics, UDP {ArduPilotLink.default_port} + {ArduPilotLink.port_step} an instance",
        (
            Arrow(to_plant=True, words="servo frame: rate, count, pulses", small=f"magic {_MAGIC}; little-endian"),
            _FLIES,
            Arrow(
                to_plant=False,
                words="one line of JSON, to the frame's sender",
                small="timestamp, imu, position, quaternion, velocity, airspeed, velocity_wind, battery",
            ),
        ),
        "each step: 1/SIM_RATE_HZ, at least 2 ms; a repeated count gets the same answer again",
    ),
    "px4": Picture(
        "PX4, the client",
        f"darko-sitl physics, TCP {Px4Link.default_port} + {Px4Link.port_step} an instance",
        (
            Arrow(to_plant=True, words="HIL_ACTUATOR_CONTROLS", small="16 controls, armed, lockstep; one a step"),
            _FLIES,
            Arrow(to_plant=False, words="HIL_GPS: 10 Hz; ODOMETRY of the cameras: 200 Hz", small="where they arrive"),
            Arrow(to_plant=False, words="HIL_STATE_QUATERNION: the truth", small="as often as PX4 asks"),
            Arrow(
                to_plant=False,
                words="HIL_SENSOR, the last: it moves PX4's clock",
                small="gyroscope, accelerometer; magnetometer, barometer, pitot: 50 Hz",
            ),
        ),
        "each step: 4 ms, 250 Hz; after 1 s without outputs one step without them",
    ),
    "betaflight": Picture(
        f"Betaflight SITL, UDP {STATE_PORT}",
        f"darko-sitl physics, UDP {BetaflightLink.default_port}",
        (
            _FLIES,
            Arrow(
                to_plant=False,
                words=f"state: {STATE.size // 8} doubles, {STATE.size} bytes",
                small="time, rates, force, attitude, velocity, position, pressure",
            ),
            Arrow(
                to_plant=True,
                words="outputs: motors, then servos",
                small="16 floats [us], 68 bytes",
            ),
        ),
        f"each step: 2 ms, 500 Hz; without outputs the state again after {1e3 * REPEAT_TIME:.0f} ms. "
        "Radio control: UDP 9004, yours",
    ),
    "paparazzi": Picture(
        "NPS, nps_fdm_pybullet.c",
        "sitl.physics.nps, in its process",
        (
            Arrow(to_plant=True, words="BulletFDM.step(commands)", small="motors left, right; elevons left, right"),
            _FLIES,
            Arrow(to_plant=False, words="pos, vel, accel, quat, ang_v, ang_accel", small="a dictionary, east-north-up"),
        ),
        "each step: the time that NPS gives; the plant goes by whole 2 ms. No packet, no port",
    ),
}


def drawn(picture: Picture) -> str:
    """The picture as SVG."""
    height = TOP + ROW * len(picture.rows) + 38
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" role="img" '
        f'aria-label="lockstep: {escape(picture.autopilot)} and the plant">',
        f"<style>{STYLE}</style>",
    ]
    bottom = TOP + ROW * len(picture.rows) - 10
    for x, who in ((LEFT, picture.autopilot), (RIGHT, picture.plant)):
        at = min(max(x, 120), WIDTH - 190)
        parts.append(f'<text class="who" x="{at}" y="24">{escape(who)}</text>')
        parts.append(f'<line x1="{x}" y1="36" x2="{x}" y2="{bottom}"/>')
    for number, row in enumerate(picture.rows):
        parts += _row(row, TOP + ROW * number)
    parts.append(f'<path d="M {LEFT - 20} {bottom - 8} H {LEFT - 60} V {TOP - 20} H {LEFT - 20}"/>')
    parts.append(f'<text class="small" x="{WIDTH // 2}" y="{bottom + 28}">{escape(picture.rate)}</text>')
    return "\n".join([*parts, "</svg>", ""])


def _row(row: Arrow | Work, y: int) -> list[str]:
    middle = (LEFT + RIGHT) // 2
    if isinstance(row, Work):
        return [
            f'<rect class="box" x="{RIGHT - 440}" y="{y - 16}" width="440" height="28" rx="4"/>',
            f'<text class="small" x="{RIGHT - 220}" y="{y + 3}">{escape(row.words)}</text>',
        ]
    kind, tip, side = ("out", RIGHT, -1) if row.to_plant else ("in", LEFT, 1)
    head = f"{tip},{y} {tip + 10 * side},{y - 5} {tip + 10 * side},{y + 5}"
    return [
        f'<line class="{kind}" x1="{LEFT}" y1="{y}" x2="{RIGHT}" y2="{y}"/>',
        f'<polygon class="{kind}" points="{head}"/>',
        f'<text x="{middle}" y="{y - 6}">{escape(row.words)}</text>',
        f'<text class="small" x="{middle}" y="{y + 15}">{escape(row.small)}</text>',
    ]


def main() -> int:
    """Write the pictures, or say which are others."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--check", action="store_true", help="write nothing; 1 if one is not as it would be drawn")
    args = options.parse_args()
    wrong = 0
    for name, picture in PICTURES.items():
        path = Path(__file__).parent.parent / "docs" / f"physics-{name}.svg"
        if not args.check:
            path.write_text(drawn(picture), encoding="utf-8")
        elif path.read_text(encoding="utf-8") != drawn(picture):
            print(f"{path}: not as it would be drawn: python -m scripts.build_lockstep")
            wrong = 1
    return wrong


if __name__ == "__main__":
    sys.exit(main())
