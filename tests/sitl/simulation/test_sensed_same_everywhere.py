"""By sensors too one seed is one flight: in another process, as plain Python, and on an older processor."""

import json
from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.support.digests.processors import OLD, printed
from tests.support.digests.sensed_digest import sensed_digests

ELSEWHERE = {
    "plain Python": {"NUMBA_DISABLE_JIT": "1", "OPENBLAS_CORETYPE": "Prescott"},
    "another process": {"NPY_DISABLE_CPU_FEATURES": OLD["NPY_DISABLE_CPU_FEATURES"]},
}


@pytest.fixture(scope="module")
def here():
    return sensed_digests()


@pytest.fixture(scope="module")
def there():
    with ThreadPoolExecutor(2) as two:
        ran = {name: two.submit(printed, "tests.support.digests.sensed_digest", [], choice)
               for name, choice in ELSEWHERE.items()}  # fmt: skip
    return {name: json.loads(" ".join(words.result())) for name, words in ran.items()}


@pytest.mark.long
@pytest.mark.parametrize("way", ELSEWHERE)
def test_a_flight_by_sensors_is_the_same_to_the_bit(way, here, there):
    assert there[way] == here


def test_they_are_different_flights(here):
    assert len(set(here.values())) == 4
