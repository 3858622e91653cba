"""A real vehicle process under numbers from the edges of float32: it stays up, and keeps what it accepts.

``python scripts/hostile_values.py --minutes 2 --seed 1`` starts ``darko-sitl``, uploads missions of random items
(infinities, NaN, denormals, 1e38 and usual numbers), flies those that are accepted, and sends such commands and
set-points. Every upload and every command must be answered, and the mission that is downloaded must be the one that
was accepted last, in flight and after a restart.

The exit code is 1 if the process ended, an internal error was logged, an answer was missing or a mission was lost.
"""

from __future__ import annotations

import argparse
import math
import random
import re
import select
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from protocol.dialect import mavlink
from protocol.plans.plan import MissionItem
from protocol.ranges import COMMAND_RANGES, ITEM_RANGES
from protocol.wire.codec import Codec
from protocol.wire.message import Message

HOST = "127.0.0.1"
ANSWER_TIME = 5.0  # for each answer [s]
FLYING_TIME = 0.3  # of each mission that is accepted [s]
SPEED = 10
LAT, LON = 435646000, 14815000
EDGES = (math.inf, -math.inf, math.nan, 1e-45, -1e-45, 1.2e-38, 1e38, -1e38, 3.4028234e38, -0.0, 1e9, 2.0**31)
USUAL = (math.nan, 0.0, 1.0, -1.0, 2.0, 3.0, 0.5, 0.05, 10.0, 22.0, 40.0, -20.0, 360.0, 65535.0)
NOT_SENT = {mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, mavlink.MAV_CMD_INJECT_FAILURE}  # they do what they are to do


class Client:
    """A ground station that sends such numbers.

    Args:
        port: Of the vehicle.
        draw: Draws the numbers.
    """

    def __init__(self, port: int, draw: random.Random) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)  # it speaks at SPEED times real time
        self._socket.bind((HOST, 0))
        self._vehicle, self._codec, self._draw = (HOST, port), Codec(255, 190), draw

    def number(self, edges: float = 0.03) -> float:
        """A number; a share of ``edges`` is from the edges of float32."""
        return self._draw.choice(EDGES if self._draw.random() < edges else USUAL)

    def items(self) -> list[MissionItem]:
        """A mission."""
        draw = self._draw
        known = sorted(set(ITEM_RANGES) - set(range(5000, 5101)))
        return [
            MissionItem(
                command=draw.choice([*known, mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_DO_JUMP]),
                frame=draw.choice([3, 3, 3, 6, 2, 1]),
                params=(self.number(), self.number(), self.number(), self.number()),
                x=LAT + draw.randint(-3000, 3000),
                y=LON + draw.randint(-3000, 3000),
                z=draw.choice([3.0, 10.0, 30.0, self.number()]),
            )
            for _ in range(draw.randint(1, 4))
        ]

    def upload(self, items: list[MissionItem]) -> int:
        """The MAV_MISSION_RESULT of an upload."""
        self.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), 0))
        while True:
            message = self.hear("MISSION_REQUEST_INT", "MISSION_ACK")
            if message.get_type() == "MISSION_ACK":
                return int(message.type)
            self.send(items[message.seq].to_message(message.seq, 1, 1))

    def download(self) -> list[bytes]:
        """The mission of the vehicle, as it is on the wire."""
        self.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
        count = self.hear("MISSION_COUNT").count
        images = []
        for seq in range(count):
            self.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, 0))
            images.append(MissionItem.from_message(self.hear("MISSION_ITEM_INT")).wire_image())
        return images

    def command(self, number: int, params: list[float]) -> int:
        """The first MAV_RESULT of a command."""
        self.send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *params))
        return int(self.hear("COMMAND_ACK", of=lambda ack: ack.command == number).result)

    def set_point(self) -> Message:
        """A set-point."""
        mask, frame = self._draw.choice([0xDF8, 0xDC7, 0xC3F, 0x000]), self._draw.choice([1, 7, 8, 9, 200])
        numbers = [self.number(0.2) for _ in range(11)]
        return mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *numbers)

    def send(self, message: Message) -> None:
        """Send a message."""
        self._socket.sendto(self._codec.encode(message), self._vehicle)

    def wait(self, seconds: float) -> None:
        """Let the vehicle fly; what it says meanwhile must not fill the socket."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            if select.select([self._socket], [], [], left)[0]:
                self._socket.recv(4096)

    def hear(self, *kinds: str, of: Callable[[Message], bool] = lambda _message: True) -> Message:
        """The next message of these kinds.

        Raises:
            TimeoutError: None has come.
        """
        end = time.monotonic() + ANSWER_TIME
        while (left := end - time.monotonic()) > 0.0:
            if select.select([self._socket], [], [], left)[0]:
                for message in self._codec.decode(self._socket.recv(4096)):
                    if message.get_type() in kinds and of(message):
                        return message
        raise TimeoutError(f"no {' or '.join(kinds)} within {ANSWER_TIME:g} s")


def main() -> int:
    """Send, and print what came of it."""
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--minutes", type=float, default=1.0, help="how long to send [1]")
    made.add_argument("--seed", type=int, default=1, help="seed of the numbers [1]")
    args = made.parse_args()
    draw, results = random.Random(args.seed), Counter[str]()  # noqa: S311 - to be repeated
    with tempfile.TemporaryDirectory() as state:
        try:
            with _vehicle(state) as port:
                accepted = _send_all(Client(port, draw), draw, 60.0 * args.minutes, results)
            with _vehicle(state) as port:
                if Client(port, draw).download() != accepted:
                    results["lost in a restart"] += 1
        except (TimeoutError, ConnectionError) as error:
            results[f"failed: {error}"] += 1
        results["internal errors"] = sum(path.read_text().count("Traceback") for path in Path(state).glob("errors.log"))
    print(", ".join(f"{count} {what}" for what, count in sorted(results.items())))
    good = {"missions accepted", "missions refused", "commands accepted", "commands refused", "set-points"}
    return int(any(count for what, count in results.items() if what not in good))


def _send_all(client: Client, draw: random.Random, seconds: float, results: Counter[str]) -> list[bytes]:
    """Send for a while; gives the mission that was accepted last, as it is on the wire."""
    accepted, end = client.download(), time.monotonic() + seconds
    numbers = sorted(set(COMMAND_RANGES) - NOT_SENT)
    while time.monotonic() < end:
        items = client.items()
        if client.upload(items) == mavlink.MAV_MISSION_ACCEPTED:
            accepted = [item.wire_image() for item in items]
            results["missions accepted"] += 1
            client.command(mavlink.MAV_CMD_MISSION_START, [math.nan] * 7)
            client.wait(FLYING_TIME)
        else:
            results["missions refused"] += 1
        for _ in range(5):
            result = client.command(draw.choice(numbers), [client.number() for _ in range(7)])
            results["commands accepted" if result in {0, 5} else "commands refused"] += 1
            client.send(client.set_point())
            results["set-points"] += 1
        if client.download() != accepted:
            results["missions lost"] += 1
            accepted = client.download()
    return accepted


@contextmanager
def _vehicle(state: str) -> Iterator[int]:
    """A vehicle in the air; gives its port.

    Raises:
        ConnectionError: It has ended before it was asked to.
    """
    program = Path(sys.executable).parent / "darko-sitl"
    options = ["--port", "0", "--gcs-port", "0", "--api-port", "0", "--speed", str(SPEED), "--start", "0,0,20,0"]
    process = subprocess.Popen(  # noqa: S603 - our own program
        [str(program), *options, "--nav", "truth", "--state-dir", state], stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None  # noqa: S101 - it is a pipe
    try:
        found = next((m for line in process.stderr if (m := re.search(r"ready after .*:(\d+)", line))), None)
        if found is None:
            raise ConnectionError("the vehicle did not start")
        yield int(found[1])
        if process.poll() is not None:
            raise ConnectionError(f"the vehicle ended with exit code {process.returncode}")
    finally:
        process.terminate()
        process.wait()


if __name__ == "__main__":
    sys.exit(main())
