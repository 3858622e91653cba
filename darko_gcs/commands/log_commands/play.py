"""``darko-gcs log play``: send a recorded flight to another ground station."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from darko_gcs.commands.log_commands.result import tell
from darko_gcs.commands.options import add_log_vehicle_option, clock_time
from protocol.tools.option_values import STATION_PORT, STATION_URL, positive_number

if TYPE_CHECKING:
    from darko_gcs.feed.outward_link import OutwardAddress
    from darko_gcs.tasks.log_player import LogPlayer

PAUSE = 0.1  # before it begins anew [s]


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``darko-gcs log play``."""
    parser.epilog = (
        f"QGroundControl and darko-gcs listen on {STATION_PORT}. Frames are sent byte for byte at their times. "
        "Not sent: signed frames, those of ground stations, damage."
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="telemetry log (.tlog)")
    parser.add_argument(
        "--to",
        default=STATION_URL,
        metavar="URL",
        help=f"where the station listens, udpout:HOST:PORT [{STATION_URL}]",
    )
    parser.add_argument("--network", action="store_true", help="allow an address of another machine")
    parser.add_argument("--speed", type=positive_number, default=1.0, metavar="X", help="playing speed [1]")
    parser.add_argument(
        "--at", type=clock_time, default=0.0, metavar="TIME", help="where to begin: seconds, M:SS or H:MM:SS [0]"
    )
    parser.add_argument("--loop", action="store_true", help="begin anew at the end, until Ctrl+C")
    add_log_vehicle_option(parser)


def run(args: argparse.Namespace) -> int:
    """Play the log.

    Raises:
        FileError: The log cannot be read, or has no such vehicle.
        GroundError: There is nothing to send, or no way to the address.
    """
    import asyncio

    from darko_gcs.errors import GroundError
    from darko_gcs.tasks.log_player import LogPlayer, loopback_or_asked
    from protocol.flight_log.flight_summary import chosen_vehicle
    from protocol.tlog import read_tlog

    address = loopback_or_asked(args.to, is_network_allowed=args.network)
    reader, name = read_tlog(args.file), str(args.file)
    if args.vehicle is not None:
        chosen_vehicle(reader, name, args.vehicle)
    player = LogPlayer(reader, speed=args.speed, vehicle=args.vehicle)
    if not len(player.frames.rows):
        raise GroundError(f"{args.file}: nothing to send: {player.frames.words}")
    if args.at >= player.frames.duration > 0.0:
        raise GroundError(f"--at {args.at:g}: the log ends after {player.frames.duration:.1f} s")
    begins = f"{args.file} to {address.words}: {player.frames.words}"
    print(begins, file=sys.stderr if args.json else sys.stdout, flush=True)
    try:
        asyncio.run(_play(player, address, args.at, is_looping=args.loop))
    except KeyboardInterrupt:
        print(file=sys.stderr if args.json else sys.stdout)
    nobody = "; at times no program listened there" if player.refused else ""
    tell(
        args,
        f"{player.sent} frames sent{nobody}; {player.answers} datagrams came back, none answered",
        file=name,
        to=args.to,
        frames=len(player.frames.rows),
        duration=player.frames.duration,
        left_out=player.frames.left_out,
        sent=player.sent,
        answers=player.answers,
        heard=not player.refused,
    )
    return 0


async def _play(player: LogPlayer, address: OutwardAddress, begin: float, *, is_looping: bool) -> None:
    import asyncio

    await player.open(address)
    try:
        await player.play(begin)
        while is_looping:
            await asyncio.sleep(PAUSE)
            await player.play()
    finally:
        player.close()
