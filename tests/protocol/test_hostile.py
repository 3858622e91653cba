"""Whatever arrives, the link's ends answer or ignore it: the kept corpus of the fuzzer, and new inputs like it."""

import random

import pytest

from protocol.codec import MOST_FLAWS, MOST_SOURCES, Codec
from protocol.dialect import mavlink
from tests.protocol.fuzz import harness
from tests.support.flood import Flood, orders
from tests.support.logs import bare

ALIVE = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def test_the_corpus_breaks_nothing():
    corpus = harness.read_corpus()
    assert len(corpus) > 40
    assert sum(map(len, corpus)) < 200_000
    for data in corpus:
        harness.run(data)


def test_inputs_like_the_corpus_break_nothing():
    draw, corpus = random.Random(5), harness.read_corpus()
    for number in range(400):
        data = harness.mutated(draw, corpus) if number % 4 else harness.fresh(draw)
        try:
            harness.run(data)
        except Exception as error:
            raise AssertionError(f"scripts/fuzz.py --replay {data.hex()}") from error


def test_the_search_sees_what_an_input_reaches():
    nothing, heartbeat = harness.covered(b"\0"), harness.covered(bytes([0, 2, 0, 0, 9, *[0] * 9]))
    assert heartbeat - nothing


def test_garbage_of_many_beginnings_is_given_up_soon():
    """Each byte may begin a frame: a long datagram of them must not hold the vehicle up."""
    codec = Codec(1, 1)
    assert codec.decode(b"\xfe" * 65_507) == []
    assert codec.statistics.garbage_bytes == 65_507
    assert codec.statistics.bad_crc <= MOST_FLAWS


def test_a_frame_behind_a_little_garbage_is_still_found():
    frame = bare(ALIVE)
    for count in (1, 10, MOST_FLAWS - 1):
        assert len(Codec(1, 1).decode(b"\xfe" * count + frame)) == 1


def test_sources_are_counted_of_a_bounded_number_and_the_busiest_stay():
    codec = Codec(1, 1)
    for number in range(20):
        codec.decode(bare(ALIVE, system=1, component=1, sequence=number))
    for number in range(5000):
        codec.decode(bare(ALIVE, system=number % 250 + 2, component=number // 250))
    assert len(codec.statistics.sources) == MOST_SOURCES
    assert codec.statistics.sources[1, 1].received == 20


def test_a_flood_is_the_same_for_the_same_seed_and_holds_no_whole_order():
    first, second = Flood(3), Flood(3)
    data = [first.datagram() for _ in range(3000)]
    assert data == [second.datagram() for _ in range(3000)]
    assert len(first.counts) == 9
    codec = Codec(1, 1)
    targets = {getattr(m, "target_system", getattr(m, "target", 7)) for d in data for m in codec.decode(d)}
    assert targets == {7}


@pytest.mark.parametrize("message", orders(1, 1), ids=lambda m: m.get_type())
def test_one_flipped_bit_anywhere_is_noticed(message):
    frame = bare(message, system=255, component=190)
    codec = Codec(1, 1)
    for bit in range(8 * len(frame)):
        damaged = bytearray(frame)
        damaged[bit // 8] ^= 1 << bit % 8
        assert codec.decode(bytes(damaged)) == []
