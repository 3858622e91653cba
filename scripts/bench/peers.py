"""Speed of our vector environment beside other simulators of drones, in one run.

``python scripts/bench/peers.py [--crazyflow PYTHON] [--pyflyt PYTHON] [--runs 3]`` takes the interpreters of
environments in which these are installed (``pip install crazyflow``, ``pip install PyFlyt``) and prints, as medians
over interleaved runs, plant steps and seconds flown by a second of the processor (of all its cores together). Each
flies as it comes: ours 1,024 hovers at 1 kHz by body rates; crazyflow 1,024 quadrotors at 500 Hz by attitudes, with a
model fitted to them and one by rotors (JAX, floats of 32 bits); PyFlyt one quadrotor at 240 Hz (Bullet, not batched).
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
from typing import NamedTuple

OURS = """
import sys, time
import numpy as np
from sitl.gym.environments import DarkoVectorEnv
env = DarkoVectorEnv(1024, "Hover", actions="rates", observe=sys.argv[1], max_episode_steps=1000)
env.reset(seed=1)
actions = np.zeros((1024, 4), np.float32)
env.step(actions)
begun, steps = time.process_time(), 0
while time.process_time() < begun + 3.0:
    env.step(actions)
    steps += 1024 * 20
print(steps / (time.process_time() - begun))
"""
CRAZYFLOW = """
import sys, time
import jax, numpy as np
from crazyflow.control import Control
from crazyflow.dynamics import Dynamics
from crazyflow.sim import Sim
sim = Sim(n_worlds=1024, control=Control.attitude, dynamics=Dynamics[sys.argv[1]], freq=500, attitude_freq=500)
sim.reset()
command = np.zeros((1024, 1, 4), np.float32)
command[..., 3] = 0.35
sim.attitude_control(command)
sim.step(10)
jax.block_until_ready(sim.data)
begun, steps = time.process_time(), 0
while time.process_time() < begun + 3.0:
    sim.attitude_control(command)
    sim.step(10)
    jax.block_until_ready(sim.data)
    steps += 1024 * 10
assert np.isfinite(np.asarray(sim.data.states.pos)).all()
print(steps / (time.process_time() - begun))
"""
PYFLYT = """
import time
import gymnasium, numpy as np
import PyFlyt.gym_envs
env = gymnasium.make("PyFlyt/QuadX-Hover-v4")
env.reset(seed=1)
substeps = 2 * env.unwrapped.env_step_ratio  # of Bullet's 240 Hz, where the drone's own loops run at 120
action = np.array([0.0, 0.0, 0.0, 0.35])
begun, steps = time.process_time(), 0
while time.process_time() < begun + 3.0:
    _, _, lost, cut, _ = env.step(action)
    steps += substeps
    if lost or cut:
        env.reset()
print(steps / (time.process_time() - begun))
"""


class Peer(NamedTuple):
    """A simulator, and the program that tells its plant steps by a second of the processor."""

    name: str
    python: str
    program: str
    rate: float  # plant steps in a second flown
    arguments: tuple[str, ...] = ()

    def measured(self) -> float:
        """Plant steps a second of the processor."""
        command = [self.python, "-W", "ignore", "-c", self.program, *self.arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - as the user gave it
        if done.returncode:
            sys.exit(f"{self.name}: {done.stderr.strip().splitlines()[-1]}")
        return float(done.stdout.split()[-1])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--crazyflow", metavar="PYTHON")
    parser.add_argument("--pyflyt", metavar="PYTHON")
    parser.add_argument("--runs", type=int, default=3)
    args = parser.parse_args()
    peers = [Peer(f"DarkO, {seen}", sys.executable, OURS, 1000.0, (seen,)) for seen in ("truth", "sensors")]
    if args.crazyflow:
        models = ("so_rpy", "first_principles")
        peers += [Peer(f"crazyflow, {model}", args.crazyflow, CRAZYFLOW, 500.0, (model,)) for model in models]
    peers += [Peer("PyFlyt", args.pyflyt, PYFLYT, 240.0)] if args.pyflyt else []
    found: dict[str, list[float]] = {peer.name: [] for peer in peers}
    for _ in range(args.runs):
        for peer in peers:
            found[peer.name].append(peer.measured())
    print("| | plant steps a second | seconds flown a second | by ours on truth |\n|---|---|---|---|")
    ours = statistics.median(found[peers[0].name]) / peers[0].rate
    for peer in peers:
        steps = statistics.median(found[peer.name])
        flown = steps / peer.rate
        print(f"| {peer.name} | {steps:,.0f} | {flown:,.0f} | {flown / ours:.3f} |")


if __name__ == "__main__":
    main()
