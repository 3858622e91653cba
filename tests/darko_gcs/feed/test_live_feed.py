"""The ground station's port: a warning if others can reach it, and one line if it cannot be opened."""

import asyncio
import sys

import pytest

from darko_gcs.commands import connect
from darko_gcs.errors import LinkError
from darko_gcs.feed import sitl_process
from darko_gcs.feed.live_feed import LiveFeed
from darko_gcs.state.values import Simulator
from darko_gcs.station.keyring_setup import open_keyring
from darko_gcs.station.station import Station

KEY, EVERYWHERE = "ab" * 32, "0.0.0.0"  # noqa: S104 - the address the warning is about


def test_without_an_option_it_listens_on_loopback():
    assert connect.parser({}).parse_args([]).host == "127.0.0.1"


@pytest.mark.parametrize(
    ("host", "key", "warned"), [(EVERYWHERE, None, 1), (EVERYWHERE, KEY, 0), ("127.0.0.1", None, 0)]
)
async def test_it_warns_about_an_open_port(host, key, warned):
    feed = LiveFeed(Station(keyring=open_keyring(key)), host, 0, None)
    await feed.open()
    try:
        texts = [entry.text for entry in feed.snapshot.log.lines]
    finally:
        await feed.close()
    assert sum("without a signing key" in text for text in texts) == warned


@pytest.mark.parametrize("host", ["a" * 300, "a..b", "\udcff"])
async def test_an_impossible_host_is_one_line(host):
    feed = LiveFeed(Station(), host, 0, None)
    with pytest.raises(LinkError, match=r"cannot listen on .{1,64}:0: "):
        await feed.open()
    await feed.close()


async def test_a_dead_simulator_is_named_and_started_again(tmp_path, monkeypatch):
    script = tmp_path / "sitl"
    ready = "print('darko-sitl: ready after 0.1 s', file=sys.stderr, flush=True)"
    script.write_text(f"#!{sys.executable}\nimport sys, time; {ready}; time.sleep(60)\n")
    script.chmod(0o755)
    monkeypatch.setattr(sitl_process, "SITL_PROGRAM", (str(script),))
    feed = LiveFeed(Station(), "127.0.0.1", 0, [])
    await feed.open()

    async def reaches(state):
        async with asyncio.timeout(20.0):
            while feed.snapshot.session.simulator is not state:
                feed.advance(0.1)
                await asyncio.sleep(0.01)

    try:
        assert feed.snapshot.session.simulator is Simulator.STARTING
        await reaches(Simulator.RUNNING)
        feed._process._process.kill()
        await reaches(Simulator.ENDED)
        assert "darko-sitl was killed (Ctrl+R restarts it)" in [entry.text for entry in feed.snapshot.log.lines]
        await asyncio.gather(feed.restart(), feed.restart())
        await reaches(Simulator.RUNNING)
        assert [entry.text for entry in feed.snapshot.log.lines].count("ready after 0.1 s") == 2
    finally:
        await feed.close()
