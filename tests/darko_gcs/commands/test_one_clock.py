"""A time that one command prints of a log is the same for all: summary, tables, page, replay and their options."""

import re

import numpy as np
import pytest

from darko_gcs.__main__ import main
from darko_gcs.feed.player import MarkKind
from darko_gcs.feed.replay_feed import ReplayFeed
from protocol.flight_log.flight_series import flight_series
from protocol.flight_log.flight_summary import of_vehicle
from protocol.tlog import read_tlog
from tests.support.gcs.messages import heartbeat, jump, position
from tests.support.logs import T0, bare, record


def vehicle(system, begin, boot, seconds, speed=1.0, first_jump=1):
    """Records [us, frame] of a vehicle from a recorder's time on [s]: a jump at each 20 s of its own, as they say.

    Args:
        system: Its id.
        begin: When it is heard first, by the recorder [s].
        boot: What its clock shows then [s].
        seconds: How long it is heard, by its own clock.
        speed: Of its clock.
        first_jump: Number of the first one.
    """
    for k in range(round(seconds * 10)):
        own = round(boot * 10) + k
        messages = [position(own * 100, 0.0)]
        messages += [heartbeat()] if k % 10 == 0 else []
        messages += [jump(first_jump + k // 200, 0.5, usec=own * 100_000)] if k % 200 == 100 else []
        for message in messages:
            yield round(T0 + (begin + k / 10 / speed) * 1e6), bare(message, system=system)


LOGS = {
    "a station's log of two vehicles": [*vehicle(1, 0.0, 900.0, 100), *vehicle(2, 40.0, 3.0, 60)],
    "a vehicle's own log": [*vehicle(1, 0.0, 396.0, 100)],
    "a restart": [*vehicle(1, 0.0, 900.0, 50), *vehicle(1, 60.0, 2.0, 60, first_jump=4)],
    "a simulation of four times the speed": [*vehicle(1, 0.0, 9.0, 200, 4.0), *vehicle(2, 20.0, 3.0, 120, 4.0)],
}


@pytest.fixture(params=LOGS)
def log(request, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    records = sorted(LOGS[request.param], key=lambda pair: pair[0])
    (tmp_path / "x.tlog").write_bytes(b"".join(record(*pair) for pair in records))
    return read_tlog(tmp_path / "x.tlog")


def printed_jumps(capsys, system):
    """Time of each jump as ``log info`` prints it, by number."""
    assert main(["log", "info", "x.tlog", "--vehicle", str(system)]) == 0
    return {int(n): time for time, n in re.findall(r"^ +(\S+) jump (\d+):", capsys.readouterr().out, re.MULTILINE)}


def systems(log):
    return sorted(set(log.systems.tolist()))


def seconds(clock):
    minutes, rest = clock.split(":")
    return 60.0 * int(minutes) + float(rest)


def test_a_table_from_a_printed_time_on_begins_there(log, tmp_path, capsys):
    for system in systems(log):
        for number, time in printed_jumps(capsys, system).items():
            begin, end = seconds(time) - 0.051, seconds(time) + 0.051
            told = ["--vehicle", str(system), "--from", f"{begin:.3f}", "--to", f"{end:.3f}"]
            assert main(["log", "export", "x.tlog", "x.csv", "DARKO_JUMP.jump", *told]) == 0
            row = (tmp_path / "x.csv").read_text().splitlines()[1].split(",")
            assert (float(row[0]), float(row[1])) == (pytest.approx(seconds(time), abs=0.051), number)
            capsys.readouterr()


def test_the_page_and_the_replay_have_the_printed_times(log, capsys):
    for system in systems(log):
        times = [seconds(time) for time in printed_jumps(capsys, system).values()]
        events = [event.time for event in flight_series(log, "x", system).events if event.kind == "jump"]
        assert events == pytest.approx(times, abs=0.051)
        feed = ReplayFeed(of_vehicle(log, "x", system), "x")
        marks = [feed.log_time(mark.time) for mark in feed.marks if mark.kind is MarkKind.JUMP]
        charted = [mark.time for mark in feed.history.marks if "hover linear" in mark.text]
        assert marks == pytest.approx(times, abs=0.11)
        assert charted == pytest.approx(times, abs=0.11)


def test_vehicles_that_one_log_has_agree_on_the_time(log, capsys):
    """Of a moment that the recorder heard of both."""
    if len(systems(log)) > 1:
        one, other = (flight_series(log, "x", system) for system in systems(log))
        assert one.position.times[-1] == pytest.approx(other.position.times[-1], abs=0.5)


async def test_a_replay_begins_at_a_printed_time(log, capsys):
    time = seconds(printed_jumps(capsys, 1)[2])
    feed = ReplayFeed(of_vehicle(log, "x", 1), "x", begin=time + 0.2)
    await feed.open()
    assert feed.log_time(feed.now) == pytest.approx(time + 0.2, abs=0.051)
    assert feed.snapshot.hybrid.jumps[-1].number == 2


def test_the_summary_says_what_the_times_are(log, capsys):
    assert main(["log", "info", "x.tlog"]) == 0
    assert "times count from the first message on, here and for --from, --to and --at" in capsys.readouterr().out


def test_a_played_log_that_begins_behind_its_end_says_when_it_ends(log, capsys):
    assert main(["log", "play", "x.tlog", "--at", "9:00", "--to", "udpout:127.0.0.1:9"]) != 0
    end = float(np.max(flight_series(log, "x").position.times))
    said = re.search(r"the log ends after (\S+) s", capsys.readouterr().err)
    assert float(said[1]) == pytest.approx(end, abs=1.0)
