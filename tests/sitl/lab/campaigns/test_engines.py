"""Engines: the same bytes by one process, by several, by a cluster, and whoever dies on the way."""

import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from functools import partial
from multiprocessing import active_children

import pytest

from sitl import SitlError
from sitl.__main__ import main
from sitl.lab.campaigns import engines
from sitl.lab.campaigns.chunks import chunk_name
from sitl.lab.campaigns.engines import fly_here, fly_packed, on_cluster, on_processes
from tests.support.campaigns import SMALL, small, small_file

MANY = {"cases": 150, "chunk": 3}


def flown_here(campaign):
    return dict(fly_here(campaign, campaign.chunks))


def test_a_worker_with_other_code_is_refused():
    with pytest.raises(SitlError, match="a worker has another version of darko"):
        fly_packed(b"", 0, 1, "other")


def test_a_cluster_without_dask_is_refused(monkeypatch):
    monkeypatch.setattr(engines, "find_spec", lambda _: None)
    with pytest.raises(SitlError, match=r"pip install 'darko\[cluster\]'"):
        engines.require_distributed()


@pytest.mark.long
def test_a_worker_that_is_killed_takes_nothing_with_it():
    campaign = small(**MANY)
    found = {}
    for cases, data in on_processes(2)(campaign, campaign.chunks):
        if len(found) == 5:
            os.kill(active_children()[0].pid, signal.SIGKILL)
        found[cases] = data
    assert found == flown_here(campaign)
    assert active_children() == []


class Deadly:
    """Ends the process that unpacks it."""

    def __reduce__(self):
        return os._exit, (1,)


@pytest.mark.long
def test_workers_that_die_again_and_again_end_the_campaign():
    with pytest.raises(SitlError, match="3 workers died without a chunk flown, of cases 0 on"):
        list(on_processes(1)(Deadly(), small().chunks))


def command(folder, *arguments):
    words = [sys.executable, "-m", "sitl", "campaign", str(folder / "small.toml"), "--out", str(folder / "out")]
    return [*words, "--cases", "150", *arguments]


def chunk_files(folder):
    return {path.name: path.read_bytes() for path in (folder / "out" / "chunks").glob("*.jsonl")}


@pytest.mark.long
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT])
def test_a_command_that_is_killed_goes_on_and_its_workers_end(tmp_path, end):
    small_file(tmp_path)
    default_interrupt = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # which a run in the background does not
    with subprocess.Popen(
        command(tmp_path, "--jobs", "2"),
        stderr=subprocess.PIPE,
        start_new_session=True,
        preexec_fn=default_interrupt,  # noqa: PLW1509 - no thread of this process holds a lock
    ) as flying:
        while flying.poll() is None and (not (tmp_path / "out").is_dir() or len(chunk_files(tmp_path)) < 5):
            time.sleep(0.02)
        flying.send_signal(end)
        flying.communicate(timeout=60)  # ends when the last worker has closed its standard error
    assert flying.returncode in {-signal.SIGKILL, 130}
    before = chunk_files(tmp_path)
    assert 5 <= len(before) < 50
    subprocess.run(command(tmp_path, "--jobs", "1"), check=True, capture_output=True)
    after, campaign = chunk_files(tmp_path), small(**MANY)
    assert before.items() <= after.items()
    assert after == {f"{chunk_name(campaign, c)}.jsonl": data for c, data in flown_here(campaign).items()}


class Cluster:
    """A scheduler and workers, each a process of its own, on loopback."""

    def __init__(self, port):
        self.address = f"tcp://127.0.0.1:{port}"
        self._port, self._stack, self.processes = port, ExitStack(), {}

    def begin(self, name):
        cli, own = "distributed.cli.dask_worker", [self.address, "--nworkers", "1", "--nthreads", "1", "--no-nanny"]
        if name == "scheduler":
            cli, own = "distributed.cli.dask_scheduler", ["--host", "127.0.0.1", "--port", str(self._port)]
        words = [sys.executable, "-m", cli, *own, "--no-dashboard"]
        started = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.processes[name] = self._stack.enter_context(started)

    def kill(self, name):
        self.processes[name].kill()
        self.processes[name].wait()

    def __enter__(self):
        for name in ("scheduler", "one", "two", "three"):
            self.begin(name)
        return self

    def __exit__(self, *_):
        for process in self.processes.values():
            process.kill()
        self._stack.close()


def free_port():
    import socket

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.mark.long
def test_a_cluster_that_loses_workers_and_its_scheduler_gives_the_same_bytes(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(engines, "CONNECTION_TIME", 60)
    campaign, told, found = small(**MANY), [], {}
    with Cluster(free_port()) as cluster:
        for cases, data in on_cluster(cluster.address, told.append)(campaign, campaign.chunks):
            assert cases not in found
            found[cases] = data
            if len(found) == 4:
                cluster.kill("one")
            if len(found) == 8:
                cluster.begin("one again")
            if len(found) == 12:
                cluster.kill("scheduler")
                for name in ("scheduler", "two again", "three again"):
                    cluster.begin(name)
    assert found == flown_here(campaign)
    assert told
    assert told[0] == f"the scheduler at {cluster.address} is lost; waiting for it"


@pytest.mark.long
def test_a_scheduler_that_is_not_there_is_told(tmp_path, capsys, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(engines, "CONNECTION_TIME", 1)
    path = small_file(tmp_path, SMALL)
    assert main(["campaign", str(path), "--out", str(tmp_path / "out"), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "--scheduler tcp://127.0.0.1:9: no scheduler answers" in capsys.readouterr().err
