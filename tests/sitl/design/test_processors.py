"""Gains do not depend on the processor: one hash over all gains, whatever loops the libraries choose."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.support.digests.processors import HASWELL, OLD, WIDE, printed

PROCESSORS = [
    {"OPENBLAS_CORETYPE": HASWELL},
    {"OPENBLAS_CORETYPE": "Prescott", "NUMBA_CPU_NAME": "generic", **OLD},
    {"OPENBLAS_CORETYPE": WIDE, "NUMBA_DISABLE_JIT": "1"},
]


def digest(choice):
    """Count and hash of every number of every design, computed by a process that thinks it runs elsewhere."""
    return printed("tests.support.digests.gains_digest", [], choice)


@pytest.mark.long
def test_every_processor_designs_the_same_numbers():
    with ThreadPoolExecutor(2) as two:
        found = list(two.map(digest, PROCESSORS))
    assert int(found[0][0]) > 50_000
    assert all(one == found[0] for one in found)
