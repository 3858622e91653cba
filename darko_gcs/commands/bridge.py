"""``darko-gcs bridge``: poses from motion capture to an autopilot."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping

from protocol.tools.command_line import command_parser
from protocol.tools.option_values import (
    VEHICLE_PORT,
    finite_number,
    ipv4_address,
    port_number,
    positive_number,
    socket_address,
    system_id,
)

_SIDES = ("left", "far", "right", "near")

_EXAMPLES = """\
examples:
  darko-gcs bridge                                   from 'darko-sitl mocap' to darko-sitl, both here
  darko-gcs bridge --server 192.168.1.10 --interface 192.168.1.20 --to 192.168.1.30:14550 --body DarkO
  darko-gcs bridge --estimator vision                to PX4: its EKF2 ignores ODOMETRY with estimator type MOCAP
  darko-gcs bridge --lab delft                       y up, long edge right, x right, nose far

Sides are as seen from the observers' seats: left, far, right, near. Ctrl-C ends the bridge.

exit codes: 2 bad argument; 3 port or link; 130 interrupted.
"""


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs bridge``."""
    parser = command_parser("darko-gcs bridge", commands, _EXAMPLES)
    _add_server_options(parser.add_argument_group("motion capture (NatNet)"))
    _add_axes_options(parser.add_argument_group("axes"))
    _add_pose_options(parser.add_argument_group("poses"))
    vehicle = parser.add_argument_group("vehicle")
    vehicle.add_argument(
        "--to",
        type=socket_address,
        default=("127.0.0.1", VEHICLE_PORT),
        metavar="ADDRESS:PORT",
        help=f"[127.0.0.1:{VEHICLE_PORT}]",
    )
    vehicle.add_argument("--system", type=system_id, default=1, metavar="ID", help="system id of the vehicle [1]")
    vehicle.add_argument(
        "--signing-key",
        metavar="KEY",
        help="sign, and accept only signed messages: 64 hexadecimal digits or a file with them",
    )
    return parser


def _add_server_options(server: argparse._ArgumentGroup) -> None:
    server.add_argument(
        "--server", type=ipv4_address, default="127.0.0.1", metavar="ADDRESS", help="address of Motive [127.0.0.1]"
    )
    server.add_argument("--command-port", type=_sending_port, default=1510, metavar="P", help="its command port [1510]")
    server.add_argument(
        "--interface",
        type=ipv4_address,
        default="127.0.0.1",
        metavar="ADDRESS",
        help="own address towards Motive [127.0.0.1]",
    )
    server.add_argument("--body", type=_body, default="", help="name or number of the rigid body [the only one]")
    server.add_argument(
        "--latency",
        type=_milliseconds,
        default=0.0,
        metavar="MS",
        help="network delay to subtract from every time stamp [0]",
    )


def _add_axes_options(axes: argparse._ArgumentGroup) -> None:
    axes.add_argument(
        "--lab",
        choices=("enac", "delft"),
        default="enac",
        help="laboratory whose axes the options below default to [enac]",
    )
    axes.add_argument("--up-axis", choices=("y", "z"), help="up in the stream; y is Motive's own")
    axes.add_argument("--long-edge", choices=_SIDES, help="side the calibration triangle's long edge pointed to")
    east = axes.add_mutually_exclusive_group()
    east.add_argument("--x-side", choices=_SIDES, help="side where x, east, shall point")
    east.add_argument(
        "--x-angle", type=finite_number, metavar="DEG", help="angle of east from the right, anticlockwise from above"
    )
    axes.add_argument(
        "--nose", choices=_SIDES, help="side the front (of a tail-sitter: its belly) pointed to when the body was made"
    )


def _add_pose_options(poses: argparse._ArgumentGroup) -> None:
    poses.add_argument(
        "--message",
        choices=("odometry", "vision", "mocap"),
        default="odometry",
        help="ODOMETRY, VISION_POSITION_ESTIMATE or ATT_POS_MOCAP [odometry]",
    )
    poses.add_argument(
        "--estimator", choices=("mocap", "vision", "vio"), default="mocap", help="estimator type in ODOMETRY [mocap]"
    )
    poses.add_argument(
        "--rate", type=positive_number, default=math.inf, metavar="HZ", help="maximum poses per second [all]"
    )
    poses.add_argument(
        "--deviation", type=positive_number, default=0.001, metavar="M", help="of positions, at least [0.001]"
    )
    poses.add_argument(
        "--attitude-deviation", type=_degrees_deviation, default=0.01, metavar="DEG", help="of attitudes [0.57]"
    )
    poses.add_argument(
        "--clock",
        choices=("auto", "local", "vehicle", "server"),
        default="auto",
        help="of the stamps; auto: ours if the vehicle asks by TIMESYNC, as PX4 does, else the server's if that is the "
        "vehicle's time since boot, as of 'darko-sitl mocap', else the vehicle's by TIMESYNC [auto]",
    )


def run(args: argparse.Namespace) -> int:
    """Bridge until it is interrupted.

    Raises:
        GroundError: The key or a port is not usable.
    """
    from darko_gcs.motion_capture.run_bridge import run_bridge

    run_bridge(args, _say)
    return 0


def _say(text: str) -> None:
    print(f"darko-gcs bridge: {text}", file=sys.stderr, flush=True)


def _degrees_deviation(text: str) -> float:
    return math.radians(positive_number(text))


def _milliseconds(text: str) -> float:
    value = finite_number(text)
    if not 0.0 <= value <= 500.0:
        raise argparse.ArgumentTypeError(f"{text} is not from 0 to 500 ms")
    return 1e-3 * value


def _body(text: str) -> str | int:
    return int(text) if text.isdecimal() else text


def _sending_port(text: str) -> int:
    value = port_number(text)
    if value == 0:
        raise argparse.ArgumentTypeError("nothing can be sent to port 0")
    return value
