"""Records: every named tuple that is kept comes back as it was, in Python and compiled."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from sitl.control.laws import Gains, LawStates
from sitl.control.reference import Reference
from sitl.estimation.filter import Filter
from sitl.estimation.sensing import SensorNoise
from sitl.model.airframe import Airframe
from sitl.model.airframe_files import load
from sitl.model.state import Actuators, Plant
from sitl.model.vectors import Vector
from sitl.sensors.instruments import Instruments
from sitl.simulation.flight import Controller, Design, Environment, Flight, JumpEntry, Sample
from sitl.simulation.loop import Diagnostics
from sitl.simulation.tuning import Tuning, designed
from sitl.storage import fields, named_from, record_of, record_type, value_of, writer, writer_at, zero
from sitl.supervisor.guards import Thresholds
from tests.support.flat import numbers_of, paths_of

KEPT = (
    Flight, Plant, Controller, LawStates, Reference, Environment, SensorNoise, Airframe, Sample, JumpEntry, Diagnostics,
    Thresholds, Actuators,
)  # fmt: skip
LEAVES = {
    float: st.floats(allow_nan=False),
    int: st.integers(-(2**53), 2**53),
    bool: st.booleans(),
}


class Inner(NamedTuple):
    """A part with a plain tuple of parts."""

    pair: tuple[Vector, Vector]
    flag: bool


Namesake = NamedTuple("Inner", [("count", int), ("length", float)])  # noqa: UP014 - another type called the same


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
    return np.array(numbers_of(value)).tobytes()


@pytest.mark.long(after=1)
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


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("kind", "path"), PARTS, ids=[f"{kind.__name__}.{path}" for kind, path in PARTS])
def test_a_part_is_read_and_written_in_its_place_and_nowhere_else(kind, path):
    put = writer(kind, lambda record: part_of(record, path))

    @settings(max_examples=10)
    @given(value=values(kind), other=values(kind))
    def check(value, other):
        part = part_of(other, path)
        record = record_of(kind, value)
        assert value_of(part_of(record[0], path)) == part_of(value, path)
        put(record[0], part)
        assert named_from(kind, record[0].item()) == with_part(value, path, part)

    check()


@pytest.mark.long
@pytest.mark.parametrize(("kind", "path"), [(Controller, ()), (Reference, ("path",)), (Outer, ())])
def test_compiled_code_reads_and_writes_the_same_places(kind, path):
    put = writer_at(kind, path)
    name = path[0] if path else ""

    @njit(error_model="numpy")
    def carried(records, others):
        first, second = records[0], others[0]
        kept = value_of(second.path) if name else value_of(second)
        put(second, value_of(first.path) if name else value_of(first))
        put(first, kept)

    @settings(max_examples=10)
    @given(value=values(kind), other=values(kind))
    def check(value, other):
        records, others = record_of(kind, value), record_of(kind, other)
        carried(records, others)
        for record, before, after in ((records, value, other), (others, other, value)):
            expected = with_part(before, name, part_of(after, name))
            back = named_from(kind, record[0].item())
            assert back == expected
            assert bits(back) == bits(expected)

    check()


class Here(NamedTuple):
    """The same fields as those of :class:`There`."""

    north: float
    east: float


class There(NamedTuple):
    """See :class:`Here`."""

    north: float
    east: float


class Both(NamedTuple):
    """Holds both."""

    here: Here
    there: There


def test_a_part_that_another_looks_like_is_read_by_what_holds_it():
    record = record_of(Both, Both(Here(1.0, 2.0), There(3.0, 4.0)))[0]
    assert value_of(record).there == There(3.0, 4.0)
    with pytest.raises(TypeError, match="Here and There have the same fields"):
        value_of(record.there)


@pytest.mark.parametrize("kind", [*KEPT, Filter, Instruments], ids=lambda kind: kind.__name__)
def test_no_field_has_a_name_that_numpy_s_records_have_of_their_own(kind):
    names = {name for path in paths_of(kind) for name in path[1:].split(".")}
    assert names & set(dir(np.record)) == set()


def test_numbers_that_are_none_are_kept_too():
    value = zero(Outer)._replace(last=math.nan)
    assert math.isnan(named_from(Outer, record_of(Outer, value)[0].item()).last)


@pytest.mark.parametrize("kind", [*KEPT, Outer], ids=lambda kind: kind.__name__)
def test_zero_is_every_number_zero_and_every_flag_down(kind):
    made = zero(kind)
    assert isinstance(made, kind)
    assert not any(numbers_of(made))
    assert bits(named_from(kind, np.zeros(1, record_type(kind))[0].item())) == bits(made)


def test_records_of_two_vehicles_have_one_type():
    """By its identity numba knows it again; else each call works it out anew, which takes longer than the flight."""
    one, other = (designed(load(name).parameters, Tuning()) for name in ("nominal", "collage"))
    assert record_of(Design, one).dtype is record_of(Design, other).dtype
    assert record_type(Plant) is record_type(Plant)


def test_a_design_is_kept_with_its_tables_of_gains():
    design = designed(load("nominal").parameters, Tuning())
    record = record_of(Design, design)
    kept = value_of(record[0].gains)
    assert isinstance(kept, Gains)
    assert np.array_equal(kept.hover_linear.K, design.gains.hover_linear.K)
    assert np.array_equal(kept.forward_linear.S, design.gains.forward_linear.S)
    assert kept.zero_moment == design.gains.zero_moment
    assert value_of(record[0].a) == design.a
    assert value_of(record[0].thresholds) == design.thresholds
