"""Records and blocks: every named tuple that is kept comes back as it was, in Python and compiled."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numba import njit

from sitl.control.laws import Gains, LawStates
from sitl.control.reference import Reference
from sitl.estimation.sensing import SensorNoise
from sitl.model.airframe import Airframe
from sitl.model.airframe_files import load
from sitl.model.state import Actuators, Plant
from sitl.model.vectors import Vector
from sitl.simulation.flight import Design, Environment, Flight, JumpEntry, Sample
from sitl.simulation.loop import Diagnostics
from sitl.simulation.tuning import Tuning, designed
from sitl.storage import (
    WIDTH,
    access,
    block_of,
    column,
    column_rows,
    fields,
    from_block,
    leaves,
    named_from,
    record_of,
    record_type,
    zero,
)
from sitl.supervisor.controller import Controller
from sitl.supervisor.guards import Thresholds

KEPT = (
    Flight, Plant, Controller, LawStates, Reference, Environment, SensorNoise, Airframe, Sample, JumpEntry, Diagnostics,
    Thresholds, Actuators,
)  # fmt: skip
LEAVES = {
    float: st.floats(allow_nan=False),
    int: st.integers(-(2**53), 2**53),  # a block keeps whole numbers as floats
    bool: st.booleans(),
}


class Inner(NamedTuple):
    """A part with a plain tuple of parts."""

    pair: tuple[Vector, Vector]
    flag: bool


Namesake = NamedTuple("Inner", [("count", int), ("size", float)])  # noqa: UP014 - another type called the same


class Outer(NamedTuple):
    """Anything that may be kept."""

    count: int
    inner: Inner
    other: Namesake
    last: float


def values(kind):
    """Any value of a named tuple."""
    if kind in LEAVES:
        return LEAVES[kind]
    parts = [values(part) for part in fields(kind).values()]
    return st.tuples(*parts) if getattr(kind, "_fields", None) is None else st.builds(kind, *parts)


def types(value):
    return [types(part) if isinstance(part, tuple) else type(part) for part in value]


def bits(value):
    """The numbers of a value to the bit: a negative zero is none of the other kind."""
    return np.array(column(value)).tobytes()


@pytest.mark.parametrize("kind", [*KEPT, Outer], ids=lambda kind: kind.__name__)
def test_a_record_gives_back_what_it_was_given(kind):
    @settings(max_examples=25)
    @given(value=values(kind))
    def check(value):
        record = record_of(kind, value)
        back = named_from(kind, record[0].item())
        assert back == value
        assert types(back) == types(value)
        assert bits(back) == bits(value)
        assert record.dtype == record_type(kind)

    check()


@pytest.mark.parametrize("kind", [*KEPT, Outer], ids=lambda kind: kind.__name__)
def test_a_block_gives_back_each_of_its_columns(kind):
    @settings(max_examples=8, suppress_health_check=[HealthCheck.large_base_example])
    @given(some=st.lists(values(kind), min_size=3, max_size=3))
    def check(some):
        kept = [some[i % 3] for i in range(WIDTH)]
        block = block_of(kept)
        assert block.shape == (WIDTH * sum(1 for _ in leaves(kind)),)
        for i, value in enumerate(kept):
            back = from_block(kind, block, i)
            assert back == value
            assert types(back) == types(value)
            assert bits(back) == bits(value)

    check()


PARTS = [
    (Flight, ""), (Flight, "plant"), (Flight, "plant.body.position"), (Flight, "controller.states.pointing"),
    (Flight, "controller.law"), (Flight, "controller.is_armed"), (Flight, "limits"), (Reference, "path"),
    (Reference, "attitude.rates"), (Outer, "inner"), (Outer, "inner.pair"), (Outer, "other"),
    (Outer, "count"),
]  # fmt: skip


def part_of(value, path):
    for name in path.split(".") if path else ():
        value = getattr(value, name)
    return value


def with_part(value, path, part):
    """The value with its part at a path replaced."""
    if not path:
        return part
    name, _, rest = path.partition(".")
    return value._replace(**{name: with_part(getattr(value, name), rest, part)})


@pytest.mark.parametrize(("kind", "path"), PARTS, ids=[f"{kind.__name__}.{path}" for kind, path in PARTS])
def test_a_part_is_read_and_written_in_its_place_and_nowhere_else(kind, path):
    get, put = access(kind, path)

    @settings(max_examples=10)
    @given(value=values(kind), other=values(kind), index=st.integers(0, WIDTH - 1))
    def check(value, other, index):
        part = part_of(other, path)
        record, block = record_of(kind, value), block_of([value] * WIDTH)
        assert get(record[0], 0) == get(block, index) == part_of(value, path)
        put(record[0], 0, part)
        put(block, index, part)
        changed = with_part(value, path, part)
        assert named_from(kind, record[0].item()) == changed
        assert [from_block(kind, block, i) for i in range(WIDTH)] == [
            changed if i == index else value for i in range(WIDTH)
        ]

    check()


@pytest.mark.parametrize(("kind", "path"), [(Controller, ""), (Reference, "path"), (Outer, "")])
def test_compiled_code_reads_and_writes_the_same_places(kind, path):
    get, put = access(kind, path)

    @njit(error_model="numpy")
    def carried(records, block, index, others):
        kept = get(records[0], 0)
        put(others[0], 0, get(block, index))
        put(block, index, kept)

    @settings(max_examples=10)
    @given(value=values(kind), other=values(kind), index=st.integers(0, WIDTH - 1))
    def check(value, other, index):
        record, block, others = record_of(kind, value), block_of([other] * WIDTH), record_of(kind, value)
        carried(record, block, index, others)
        assert named_from(kind, others[0].item()) == with_part(value, path, part_of(other, path))
        back = from_block(kind, block, index)
        assert back == with_part(other, path, part_of(value, path))
        assert bits(back) == bits(with_part(other, path, part_of(value, path)))
        assert from_block(kind, block, (index + 1) % WIDTH) == other

    check()


def test_numbers_that_are_none_are_kept_too():
    value = zero(Outer)._replace(last=math.nan)
    assert math.isnan(named_from(Outer, record_of(Outer, value)[0].item()).last)
    assert math.isnan(from_block(Outer, block_of([value] * WIDTH), 3).last)


@pytest.mark.parametrize("kind", [*KEPT, Outer], ids=lambda kind: kind.__name__)
def test_rows_of_a_block_are_the_leaves_in_order(kind):
    names = [leaf.path[1:] for leaf in leaves(kind)]
    assert [leaf.row for leaf in leaves(kind)] == list(range(len(names)))
    assert column_rows(kind, *names) == tuple(range(len(names)))
    assert len(set(names)) == len(names) == len(column(zero(kind)))


@pytest.mark.parametrize("kind", [*KEPT, Outer], ids=lambda kind: kind.__name__)
def test_zero_is_every_number_zero_and_every_flag_down(kind):
    made = zero(kind)
    assert isinstance(made, kind)
    assert not any(column(made))
    assert bits(named_from(kind, np.zeros(1, record_type(kind))[0].item())) == bits(made)


def test_a_design_is_kept_with_its_tables_of_gains():
    design = designed(load("nominal").parameters, Tuning())
    record = record_of(Design, design)
    kept = access(Design, "gains").get(record[0], 0)
    assert isinstance(kept, Gains)
    assert np.array_equal(kept.hover_linear.K, design.gains.hover_linear.K)
    assert np.array_equal(kept.forward_linear.S, design.gains.forward_linear.S)
    assert kept.zero_moment == design.gains.zero_moment
    assert access(Design, "a").get(record[0], 0) == design.a
    assert access(Design, "thresholds").get(record[0], 0) == design.thresholds
