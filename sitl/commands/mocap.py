"""``darko-sitl mocap``: a simulated Motive for the running vehicle."""

from __future__ import annotations

import argparse
import ipaddress
import sys
from collections.abc import Mapping

from protocol.tools.command_line import command_parser
from protocol.tools.option_values import (
    VEHICLE_PORT,
    finite_number,
    ipv4_address,
    natural_number,
    port_number,
    share,
    socket_address,
    system_id,
)

SIDE_NAMES = ("left", "far", "right", "near")

_EXAMPLES = """\
examples:
  darko-sitl --arena voliere --mocap external      a vehicle that flies on nothing but poses from outside
  darko-sitl mocap                                 its Motive: NatNet 3.1, multicast, ENAC's axes
  darko-gcs bridge                                 from one to the other
  darko-sitl mocap --natnet 4.1 --unicast          as Motive 3.1 does, to each client
  darko-sitl mocap --up-axis y --long-edge right   Delft's axes
  darko-sitl mocap --event lost@20+1.5 --event swap@40+0.5

While it runs, type lost, swap or dropped, with seconds or without, or ok. Times of events count from the first frame.
"""


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl mocap``."""
    parser = command_parser("darko-sitl mocap", commands, _EXAMPLES)
    _add_stream_options(parser.add_argument_group("stream"))
    _add_hall_options(parser.add_argument_group("hall (as for darko-gcs bridge)"))
    _add_error_options(parser.add_argument_group("errors"))
    vehicle = parser.add_argument_group("vehicle")
    vehicle.add_argument(
        "--vehicle",
        type=socket_address,
        default=("127.0.0.1", VEHICLE_PORT),
        metavar="ADDRESS:PORT",
        help=f"[127.0.0.1:{VEHICLE_PORT}]",
    )
    vehicle.add_argument("--system", type=system_id, default=1, metavar="ID", help="system id of the vehicle [1]")
    vehicle.add_argument("--signing-key", metavar="KEY", help="of the vehicle: 64 hexadecimal digits or their file")
    parser.add_argument("--quiet", action="store_true", help="print errors only")
    return parser


def _add_stream_options(stream: argparse._ArgumentGroup) -> None:
    stream.add_argument(
        "--natnet", choices=("3.0", "3.1", "4.0", "4.1"), default="3.1", help="version of the bit-stream [3.1]"
    )
    stream.add_argument("--unicast", action="store_true", help="send to each client instead of a multicast group")
    stream.add_argument(
        "--bind", type=ipv4_address, default="127.0.0.1", metavar="ADDRESS", help="local address [127.0.0.1]"
    )
    stream.add_argument("--command-port", type=port_number, default=1510, metavar="P", help="0: any [1510]")
    stream.add_argument(
        "--data-port", type=port_number, default=1511, metavar="P", help="of the multicast group [1511]"
    )
    stream.add_argument("--multicast", type=_group, default="239.255.42.99", metavar="GROUP", help="[239.255.42.99]")
    stream.add_argument("--body", metavar="FILE", help="TOML file with name, number and markers of the rigid body")


def _add_hall_options(hall: argparse._ArgumentGroup) -> None:
    hall.add_argument("--up-axis", choices=("y", "z"), default="z", help="of the stream; y is Motive's own [z]")
    hall.add_argument(
        "--long-edge", choices=SIDE_NAMES, default="near", help="side the calibration's long edge pointed to [near]"
    )
    east = hall.add_mutually_exclusive_group()
    east.add_argument("--x-side", choices=SIDE_NAMES, help="side of the vehicle's east [right]")
    east.add_argument(
        "--x-angle",
        type=finite_number,
        default=0.0,
        metavar="DEG",
        help="east from the right, anticlockwise from above",
    )
    hall.add_argument(
        "--nose", choices=SIDE_NAMES, default="far", help="side the front (on the tail: the belly) pointed to [far]"
    )


def _add_error_options(errors: argparse._ArgumentGroup) -> None:
    errors.add_argument("--sensors", metavar="FILE", help="TOML file that overrides values of motion_capture")
    errors.add_argument("--rate", type=finite_number, metavar="HZ", help="frames a second, 10 to 250 [200]")
    errors.add_argument("--delay", type=share, metavar="S", help="from exposure to sending [0.02]")
    errors.add_argument("--jitter", type=share, metavar="S", help="standard deviation of more delay [0.001]")
    errors.add_argument("--dropout", type=share, metavar="SHARE", help="of frames that never arrive [0.001]")
    errors.add_argument("--noise", type=share, metavar="M", help="of the position, per axis [0.0005]")
    errors.add_argument(
        "--event",
        action="append",
        default=[],
        metavar="KIND@START+SECONDS",
        help="lost: tracking lost; swap: markers taken for one another; dropped: no frames; may be repeated",
    )
    errors.add_argument("--seed", type=natural_number, default=1, metavar="N", help="of the errors [1]")


def run(args: argparse.Namespace) -> int:
    """Serve until it is interrupted."""
    from sitl.motion_capture.motive_process import serve_motion_capture  # noqa: PLC0415 - --help must be quick

    serve_motion_capture(args, (lambda _text: None) if args.quiet else _say)
    return 0


def _say(text: str) -> None:
    print(f"darko-sitl mocap: {text}", file=sys.stderr, flush=True)


def _group(text: str) -> str:
    if not ipaddress.IPv4Address(ipv4_address(text)).is_multicast:
        raise argparse.ArgumentTypeError(f"{text!r} is not a multicast address")
    return text
