"""The message log: STATUSTEXT chunks are joined, its size is bounded."""

from darko_gcs.state.message_log import MAX_LINES, add_line
from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from protocol.dialect import mavlink
from protocol.wire.codec import Codec
from tests.support.gcs.messages import arrived, heartbeat, position, text


def after(messages, s=EMPTY_SNAPSHOT, codec=None):
    for message in messages:
        s = reduce(s, arrived(message, codec) if codec else arrived(message), 1.0)
    return s


def test_chunks_of_a_long_text_are_joined():
    s = after([text(b"a" * 50, number=9, chunk=0), text(b"end", number=9, chunk=1)])
    assert [line.text for line in s.log.lines] == ["a" * 50 + "end"]


def test_a_chunk_that_continues_no_line_is_a_line_of_its_own_however_often_it_comes():
    s = after([text(b"b" * 50, number=9, chunk=7)] * 400, after([heartbeat()]))
    assert len(s.log.lines) == MAX_LINES
    assert {line.text for line in s.log.lines} == {"b" * 50}


def test_a_text_cannot_control_the_terminal():
    assert after([text(b"\x1b[2Jdone\x07")]).log.lines[-1].text == "?[2Jdone?"


def test_texts_of_the_vehicles_other_components_are_shown_but_not_their_positions():
    s = after([heartbeat(), position(10, 1.0)])
    s = after([position(20, 99.0), text(b"camera ready")], s, codec=Codec(1, 100))
    assert s.position.p[0] == 1.0
    assert s.log.lines[-1].text == "camera ready"


def test_the_log_is_bounded():
    s = EMPTY_SNAPSHOT
    for n in range(MAX_LINES + 20):
        s = add_line(s, float(n), mavlink.MAV_SEVERITY_INFO, str(n))
    assert len(s.log.lines) == MAX_LINES
    assert s.log.lines[-1].text == str(MAX_LINES + 19)
