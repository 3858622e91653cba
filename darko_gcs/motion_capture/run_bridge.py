"""Builds a bridge from the options of ``darko-gcs bridge``, and runs it."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import ExitStack

from darko_gcs.motion_capture.arena_axes import AXES_OF_LABS, HALL_SIDES, AxesSettings
from darko_gcs.motion_capture.autopilot_link import AutopilotLink
from darko_gcs.motion_capture.bridge_sockets import BridgeAddresses, BridgeSockets
from darko_gcs.motion_capture.natnet_link import NatnetLink
from darko_gcs.motion_capture.pose_bridge import BridgeSettings, PoseBridge
from darko_gcs.motion_capture.pose_messages import ESTIMATORS, PoseAccuracy
from darko_gcs.station.keyring_setup import open_keyring


def axes_settings(args: argparse.Namespace) -> AxesSettings:
    """Axes of the lab that the options name, with the axes that they give changed."""
    lab = AXES_OF_LABS[args.lab]
    angle = lab.x_angle if args.x_angle is None else args.x_angle
    return AxesSettings(
        up_axis=args.up_axis or lab.up_axis,
        long_edge=args.long_edge or lab.long_edge,
        x_angle=angle if args.x_side is None else HALL_SIDES[args.x_side],
        nose=args.nose or lab.nose,
    )


def run_bridge(args: argparse.Namespace, say: Callable[[str], None]) -> None:
    """Bridge until it is interrupted.

    Args:
        args: Options of ``darko-gcs bridge``.
        say: Tells a person what happens.

    Raises:
        GroundError: The key or a port is not usable.
    """
    settings = BridgeSettings(
        axes=axes_settings(args),
        body=args.body,
        message=args.message,
        rate=args.rate,
        latency=args.latency,
        accuracy=PoseAccuracy(args.deviation, args.attitude_deviation, ESTIMATORS[args.estimator]),
    )
    natnet, autopilot = NatnetLink(), AutopilotLink(args.system, open_keyring(args.signing_key), args.clock)
    addresses = BridgeAddresses(args.server, args.command_port, args.interface, args.to)
    axes = settings.axes
    say(
        f"NatNet at {args.server}:{args.command_port} -> {args.message.upper()} to {args.to[0]}:{args.to[1]}; "
        f"{axes.up_axis} up, long edge {axes.long_edge}, east at {axes.x_angle:g} deg from the right, nose {axes.nose}"
    )
    with ExitStack() as stack:
        BridgeSockets(PoseBridge(settings, natnet, autopilot), natnet, autopilot, addresses, stack).run(say)
