"""Telemetry logs of episodes, which the ground station replays and makes pages with a 3-D view of."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from protocol.dialect import mavlink
from protocol.errors import ProtocolError
from protocol.frames import LocalFrame
from protocol.tools.files import write_atomically
from sitl import Aircraft, Configuration, Simulation, SitlError, Start
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.gym.environments import DarkoEnv, Observation
from sitl.gym.flight_batch import FlightBatch
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.node import Node
from sitl.storage import copy_of
from sitl.tools.persistence import StateFolder

LOG_EPOCH = 0.0  # of time stamps: the same episode gives the same bytes [s since 1970]
TRUTH_SHOWN = 10.0  # in the log [Hz]


class FollowedAircraft(Aircraft):
    """An aircraft whose state is that of a flight of a batch: it flies nothing itself, and is looked at.

    Args:
        batch: The flights.
        number: Which of them.
    """

    def __init__(self, batch: FlightBatch, number: int) -> None:
        self._batch, self._number = batch, number
        start = Start(up=batch.task.goal.place.z, airborne=True)
        world = World(LocalFrame(HOME), ARENAS["open"])
        super().__init__(Simulation(batch.airframe, start=start), world, Configuration(), airborne=True)
        self._take()

    def advance(self, periods: int) -> None:  # noqa: ARG002 - the batch has flown them
        """Take the state that the batch has come to."""
        self._take()
        self._decide()
        self._take()

    def _take(self) -> None:
        fleet = self._batch.fleet
        self.vehicle.set_wind(fleet.airs["wind"][self._number].item())
        self.vehicle.flight = copy_of(fleet.flights[self._number])
        self.vehicle.reference = copy_of(fleet.references[self._number])


class FlightFollower:
    """Writes the log of one flight of a batch, from where it is now on.

    Args:
        batch: The flights.
        number: Which of them.
    """

    def __init__(self, batch: FlightBatch, number: int = 0) -> None:
        self._folder = TemporaryDirectory()
        self._periods, folder = batch.options.periods, Path(self._folder.name)
        also = {mavlink.MAVLINK_MSG_ID_DARKO_TRUTH: TRUTH_SHOWN}
        self._recorder = FlightRecorder(folder, lambda: LOG_EPOCH, whole=True, also=also)
        self._node = Node(FollowedAircraft(batch, number), StateFolder(folder), recorder=self._recorder)

    def follow(self) -> None:
        """Record the state after a step."""
        self._node.advance(self._periods)
        self._node.datagrams(self._node.aircraft.vehicle.time)

    def finish(self, path: Path) -> None:
        """Write the log to a file, and forget it.

        Raises:
            SitlError: The file cannot be written.
        """
        self._recorder.close()
        log = Path(self._folder.name) / self._recorder.logs()[-1].name
        try:
            write_atomically(path, log.read_bytes())
        except ProtocolError as error:
            raise SitlError(str(error)) from error
        finally:
            self._folder.cleanup()


class EpisodeLog(gymnasium.Wrapper[Observation, npt.NDArray[np.float32], Observation, npt.NDArray[np.float32]]):
    """Writes each episode of an environment to ``episode-N.tlog``, as it ends or the environment is closed.

    Args:
        env: An environment of this package.
        folder: For the logs, which must be there.

    Raises:
        SitlError: If the environment is another one, or there is no folder.
    """

    def __init__(self, env: gymnasium.Env[Observation, npt.NDArray[np.float32]], folder: Path) -> None:
        super().__init__(env)
        if not isinstance(env.unwrapped, DarkoEnv):
            raise SitlError(f"{env}: no environment of DarkO")
        if not folder.is_dir():
            raise SitlError(f"{folder}: there is no such folder")
        self._folder, self._batch, self._written = folder, env.unwrapped.batch, 0
        self._follower: FlightFollower | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode and its log."""
        self._finish()
        found = super().reset(seed=seed, options=options)
        self._follower = FlightFollower(self._batch)
        return found

    def step(self, action: npt.NDArray[np.float32]) -> tuple[Observation, Any, bool, bool, dict[str, Any]]:
        """Fly and record an interval."""
        found = super().step(action)
        if self._follower is not None:
            self._follower.follow()
        if found[2] or found[3]:
            self._finish()
        return found

    def close(self) -> None:
        """Write the log of the episode under way."""
        self._finish()
        super().close()

    def _finish(self) -> None:
        if self._follower is not None:
            self._written += 1
            self._follower.finish(self._folder / f"episode-{self._written}.tlog")
            self._follower = None
