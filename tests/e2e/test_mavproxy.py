"""MAVProxy flies the real process with commands as a pilot types them; its own log is checked too."""

import pytest

from protocol.tlog import read_tlog
from tests.e2e.support import BRISK, fly, free_ports, need, vehicle


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    need("MAVProxy")
    (port,) = free_ports(1)
    folder = tmp_path_factory.mktemp("mavproxy")
    with vehicle(port, tmp_path_factory.mktemp("state"), "--speed", "5", *BRISK):
        code, output = fly("mavproxy_session.py", "--master", f"udpin:127.0.0.1:{port}", "--folder", str(folder))
    assert code == 0, output
    return folder


@pytest.mark.long
def test_every_typed_line_is_answered(session):
    assert (session / "plan.waypoints").exists()


@pytest.mark.long
def test_the_plan_comes_back_as_it_was_loaded(session):
    sent, back = ((session / name).read_text().splitlines()[1:] for name in ("plan.waypoints", "way.txt"))
    for one, other in zip(sent, back, strict=True):
        ours, theirs = one.split("\t"), other.split("\t")
        assert ours[2:4] == theirs[2:4]  # frame and command
        # MAVProxy cuts coordinates off where it should round them, on the way out and on the way back.
        assert [float(x) for x in ours[4:11]] == pytest.approx([float(x) for x in theirs[4:11]], abs=2.1e-7)


@pytest.mark.long
def test_mavproxys_log_is_undamaged_and_holds_an_answer_to_every_command(session):
    log = read_tlog(session / "flight.tlog")
    assert not log.damage
    asked = len(log.rows("COMMAND_LONG"))
    assert asked > 8
    assert len(log.rows("COMMAND_ACK")) >= asked
