"""Real processes: the commands a user types."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from pymavlink import mavutil

import darko_gcs.__main__ as darko_gcs
import sitl.__main__ as sitl
from protocol.tlog import read_tlog
from tests.support.paths import DATA

BIN = Path(sys.executable).parent


def run(*arguments, timeout=120):
    """Run a command that needs no terminal."""
    return subprocess.run([str(BIN / arguments[0]), *arguments[1:]], capture_output=True, text=True, timeout=timeout)


@pytest.mark.long
@pytest.mark.parametrize("program", ["darko-sitl", "darko-gcs"])
def test_version_and_help(program):
    assert run(program, "--version").stdout.startswith(f"{program} 0.")
    shown = run(program, "--help")
    assert shown.returncode == 0
    assert "examples:" in shown.stdout


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("module", "arguments"),
    [
        ("sitl", []),
        ("sitl", ["study"]),
        ("sitl", ["study", "scenario"]),
        ("darko_gcs", []),
        ("darko_gcs", ["fly"]),
        ("darko_gcs", ["replay"]),
    ],
)
def test_help_loads_neither_the_compiler_nor_the_screens_nor_plots(module, arguments):
    code = f"""
import sys
from {module}.__main__ import main
try:
    main({[*arguments, "--help"]!r})
except SystemExit:
    pass
print([name for name in ("numba", "textual", "scipy", "matplotlib", "protocol.dialect.mavlink") if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines()[-1] == "[]", done.stdout + done.stderr


@pytest.mark.long
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("darko-sitl", "--airframe", "nosuch", "--port", "0"), "no parameter set 'nosuch'"),
        (("darko-gcs", "fly", "--mission", "nosuch.plan", "--headless"), "nosuch.plan"),
    ],
)
def test_bad_arguments_end_the_process_with_one_line_and_an_exit_code(arguments, words):
    done = run(*arguments)
    assert done.returncode not in {0, 1}
    assert words in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("program", "arguments", "words"),
    [
        (sitl, ("--param", "NOPE=1", "--port", "0"), "no parameter NOPE"),
        (sitl, ("--param", "DRK_KPP=99", "--port", "0"), "DRK_KPP = 99 is outside"),
        (sitl, ("study", "scenario", "nosuch"), "no scenario 'nosuch'"),
        (sitl, ("falls", "--flights", "1"), "'falls' is now 'darko-sitl study falls'"),
        (darko_gcs, ("log", "info", str(DATA / "square.plan")), "square.plan"),
        (darko_gcs, ("replay", "nosuch.tlog"), "nosuch.tlog"),
    ],
)
def test_bad_arguments_give_one_line_and_an_exit_code(program, arguments, words, tmp_path, capsys):
    """As processes do, of which each takes seconds to start."""
    state = ("--state-dir", str(tmp_path)) if "--param" in arguments else ()
    assert program.main([*arguments, *state]) not in {0, 1}
    printed = capsys.readouterr()
    assert printed.out == ""
    assert words in printed.err
    assert len(printed.err.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("program", "arguments"),
    [
        (sitl, ("--state-dir", "logs")),
        (darko_gcs, ("fly", "--mission", str(DATA / "square.plan"), "--headless", "--record", "logs")),
    ],
)
def test_a_port_in_use_is_an_error_with_its_address(program, arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = str(taken.getsockname()[1])
        assert program.main([*arguments, "--port", port]) in {2, 3}
    assert f"127.0.0.1:{port}" in capsys.readouterr().err


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """One scripted flight of the square, with its log."""
    folder = tmp_path_factory.mktemp("flight")
    done = run("darko-gcs", "fly", "--mission", str(DATA / "square.plan"), "--sitl", "--headless", "--json",
               "--speed", "10", "--port", "0", "--record", str(folder))  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.long
def test_the_square_is_flown_within_half_a_metre_and_landed(flight):
    assert flight["reached"] == [0, 1, 2, 3, 4, 5]
    assert set(flight["miss"]) == {"1", "2", "3", "4"}
    assert max(flight["miss"].values()) < 0.5


@pytest.mark.long
def test_the_log_holds_the_whole_flight(flight, capsys):
    reader = read_tlog(flight["log"])
    assert not reader.damage
    assert reader.known.all()
    assert darko_gcs.main(["log", "info", flight["log"], "--json"]) == 0
    info = json.loads(capsys.readouterr().out)
    assert sum(row["count"] for row in info["messages"]) == len(reader)


@pytest.mark.long
def test_unmodified_pymavlink_reads_every_message_of_the_log(flight, monkeypatch):
    monkeypatch.setitem(os.environ, "MAVLINK20", "1")
    log, ours = mavutil.mavlink_connection(flight["log"], dialect="common"), read_tlog(flight["log"])
    kinds = []
    while (message := log.recv_msg()) is not None:
        kinds.append(message.get_type())
    assert len(kinds) == len(ours)
    assert "BAD_DATA" not in kinds
    assert kinds.count("ATTITUDE") == len(ours.rows("ATTITUDE"))


@pytest.mark.long
def test_output_that_is_cut_off_by_its_reader_is_no_error():
    command = f"{BIN / 'darko-sitl'} airframe published --trims | head -1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, timeout=60)  # noqa: S602 - a pipe is meant
    assert done.stderr == ""
