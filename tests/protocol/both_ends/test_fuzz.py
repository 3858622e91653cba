"""The stored inputs of the fuzzer, and mutations of them, raise no error at either end."""

import random

import pytest

from tests.support.links import fuzz as harness


@pytest.mark.long
def test_no_stored_input_raises():
    corpus = harness.read_corpus()
    assert len(corpus) > 40
    assert sum(map(len, corpus)) < 200_000
    for data in corpus:
        harness.run(data)


@pytest.mark.long
def test_no_mutated_input_raises():
    draw, corpus = random.Random(5), harness.read_corpus()
    for number in range(400):
        data = harness.mutated(draw, corpus) if number % 4 else harness.fresh(draw)
        try:
            harness.run(data)
        except Exception as error:
            raise AssertionError(f"scripts/fuzz.py --replay {data.hex()}") from error


def test_the_search_records_the_code_that_an_input_reaches():
    nothing, heartbeat = harness.covered(b"\0"), harness.covered(bytes([0, 2, 0, 0, 9, *[0] * 9]))
    assert heartbeat - nothing
