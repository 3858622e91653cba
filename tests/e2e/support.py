"""A real vehicle process on ports of its own, for real clients."""

import json
import re
import socket
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from darko_gcs.__main__ import main
from sitl.tools.persistence import StateFolder

ROOT = Path(__file__).parents[2]
CLIENTS = ROOT / "scripts" / "clients"
BIN = Path(sys.executable).parent
BRISK_RATES = {"MPC_TKO_SPEED": 2.0, "MPC_LAND_SPEED": 1.0}  # climbs and lands twice as fast as usual
BRISK = tuple(word for name, value in BRISK_RATES.items() for word in ("--param", f"{name}={value}"))


def free_ports(count):
    """Unused UDP ports of the loopback interface, all different."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


@contextmanager
def vehicle(port, state_dir, *arguments):
    """``darko-sitl`` that sends to ``port``; yields its own port once it is ready, and must live until the end."""
    with running(port, state_dir, *arguments) as (process, own):
        yield own
        assert process.poll() is None, "the vehicle died"
        errors = [path.read_text(encoding="utf-8") for path in Path(state_dir).rglob("errors.log")]
        assert not errors, "\n".join(errors)


@contextmanager
def running(port, state_dir, *arguments):
    """The same, but it may end by itself; yields the process and its port."""
    process = subprocess.Popen(
        [str(BIN / "darko-sitl"), "--port", "0", "--gcs-port", str(port), "--api-port", "0",
         "--state-dir", str(state_dir), *arguments],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    printed = []
    try:
        for line in process.stderr:
            printed.append(line)
            if ready := re.search(r"ready after .*?127\.0\.0\.1:(\d+)", line):
                yield process, int(ready[1])
                return
        raise AssertionError("".join(printed))
    finally:
        process.kill()
        process.wait()
        process.stderr.close()


def brisk(folder):
    """State of a vehicle that climbs and lands fast, for ``darko-gcs --sitl``; the arguments that lead to it."""
    folder.mkdir()
    StateFolder(folder).save_parameters(BRISK_RATES)
    return "--state-dir", str(folder)


def need(module):
    """Skip a test whose client cannot be imported."""
    done = subprocess.run([sys.executable, "-c", f"import {module}"], capture_output=True, text=True, timeout=60)
    if done.returncode:
        pytest.skip(f"{module} cannot be imported: {done.stderr.strip().splitlines()[-1]}")


def fly(script, *arguments, timeout=150):
    """Run a session of scripts/clients; exit code and output."""
    command = [sys.executable, str(CLIENTS / script), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=timeout)
    return done.returncode, done.stdout + done.stderr


def answered(capsys, port, *words):
    """Exit code of a command and its answer as JSON, run in this process: to start one takes longer than to answer."""
    capsys.readouterr()
    code = main([*words, "--port", str(port), "--json"])
    return code, json.loads(capsys.readouterr().out.splitlines()[-1])
