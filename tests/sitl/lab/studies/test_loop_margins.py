"""Margins of loops: by the textbook's, and by the flight of the vehicle itself."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sitl import PERIOD, SitlError, Vector, load_airframe
from sitl.__main__ import main
from sitl.lab.studies import loop_margins
from sitl.lab.studies.loop_margins import (
    FREQUENCIES,
    MIXED,
    UNSTABLE,
    LawMargins,
    LoopMargin,
    loop_table,
    margin_of,
    numbers,
    opened,
    period_map,
    responses,
    settled,
    with_numbers,
)

HOVER = loop_margins.SETTLED_FLIGHTS[0]


def test_an_integrator_with_a_delay_has_the_margins_of_the_textbook():
    k, tau = 4.0, 0.1
    loop = k * np.exp(-1j * FREQUENCIES * tau) / (1j * FREQUENCIES)
    margin = margin_of("pitch", loop)
    assert margin.greatest_gain == pytest.approx(math.pi / (2.0 * k * tau), rel=0.01)
    assert margin.least_gain == 0.0
    assert margin.phase == pytest.approx(math.pi / 2.0 - k * tau, rel=0.01)
    assert margin.crossover == pytest.approx(k, rel=0.01)
    assert margin.delay == pytest.approx(math.pi / (2.0 * k) - tau, rel=0.01)


def test_a_loop_that_needs_its_gain_says_how_little_it_bears():
    """30 (s + 1)/((s - 1)(s + 0.1)(s + 10)), an unstable plant, against the roots of its closed loop."""
    s = 1j * FREQUENCIES
    margin = margin_of("pitch", 30.0 * (1.0 + s) / (s - 1.0) / (s + 0.1) / (s + 10.0))
    assert margin.greatest_gain == math.inf
    loop = np.poly1d([1.0, -1.0]) * np.poly1d([1.0, 0.1]) * np.poly1d([1.0, 10.0])
    for gain, stable in ((1.03 * margin.least_gain, True), (0.97 * margin.least_gain, False)):
        assert bool((np.roots((loop + 30.0 * gain * np.poly1d([1.0, 1.0])).coeffs).real < 0.0).all()) is stable


def test_numbers_are_put_back_where_they_were():
    value = (Vector(1.0, 2.0, 3.0), True, 4, ("x", 5.0))
    assert dict(numbers(value)) == {"0.x": 1.0, "0.y": 2.0, "0.z": 3.0, "3.1": 5.0}
    assert with_numbers(value, iter((6.0, 7.0, 8.0, 9.0))) == (Vector(6.0, 7.0, 8.0), True, 4, ("x", 9.0))


@pytest.fixture(scope="module")
def hovering():
    return settled(HOVER, load_airframe("collage").parameters)


def test_the_map_tells_how_a_flight_goes_on_from_beside_it(hovering):
    """A flight begun 1 mm aside, over a tenth of a second, by the map and flown."""
    about, before = hovering.flight, dict(numbers(hovering.flight))
    A = period_map(hovering).A
    assert hovering.flight == about
    offset = np.zeros(len(A))
    place = list(before).index("plant.body.position.x")
    offset[[place, list(before).index("estimate.position.x")]] = 1e-3
    ends = []
    for start in (np.zeros(len(A)), offset):
        hovering.flight = with_numbers(about, iter((np.array(list(before.values())) + start).tolist()))
        hovering.advance(50)
        ends.append(dict(numbers(hovering.flight)))
    hovering.flight = about
    told = np.linalg.matrix_power(A, 50) @ offset
    for name in ("plant.body.position.x", "plant.body.rates.y", "plant.actuators.left_elevon"):
        assert_allclose(told[list(before).index(name)], ends[1][name] - ends[0][name], rtol=0.01, err_msg=name)


def test_a_loop_beyond_its_gain_margin_is_unstable_and_within_it_stable(hovering):
    """The eigenvalues of the loop closed by a factor agree with what its response over frequency says."""
    around = period_map(hovering)
    R, B, E = opened(around)
    margin = margin_of("roll", responses(around)[:, 3])
    unmixed = np.linalg.inv(MIXED)
    for factor, stable in ((1.0, True), (0.9 * margin.greatest_gain, True), (1.1 * margin.greatest_gain, False)):
        closed = R + B @ unmixed @ np.diag((1.0, 1.0, 1.0, factor)) @ MIXED @ E
        assert bool(np.abs(np.linalg.eigvals(closed)).max() < UNSTABLE) is stable, factor


def test_a_law_that_is_about_to_be_left_has_no_settled_flight(hovering):
    about = hovering.flight
    hovering.armed = False
    try:
        with pytest.raises(SitlError, match="a jump falls due"):
            period_map(hovering)
    finally:
        hovering.flight = about


@pytest.mark.long
def test_every_settled_flight_is_under_the_law_that_its_row_is_for():
    a = load_airframe("collage").parameters
    laws = [settled(flight, a).law.name for flight in loop_margins.SETTLED_FLIGHTS]
    hovers = ["HOVER_LINEAR", "HOVER_ZERO_MOMENT", "INDI", "ROBUST_PI"]
    assert laws == [
        *hovers,
        "HOVER_LINEAR",
        "INDI",
        "ROBUST_PI",
        "FORWARD_LINE_OF_SIGHT",
        "FORWARD_LINEAR",
        "INDI",
    ]


def test_the_study_tells_by_its_exit_code_what_bears_too_little(monkeypatch, capsys, tmp_path):
    def fly(*flights):
        monkeypatch.setattr(loop_margins, "SETTLED_FLIGHTS", flights)
        code = main(["study", "loops", "--json", str(tmp_path / "loops.json")])
        return code, capsys.readouterr().out

    code, text = fly(HOVER)
    assert code == 0
    assert "HOVER_LINEAR" in text
    assert "of 1 settled flights under laws of ours 0 are unstable, 0 loops bear less" in text
    assert '"channel": "roll"' in (tmp_path / "loops.json").read_text(encoding="utf-8")
    monkeypatch.setattr(loop_margins, "MIN_PHASE", math.pi)
    assert fly(HOVER)[0] == 1
    assert main(["study", "loops", "--airframe", "no-such"]) == 2


def test_the_table_marks_what_bears_too_little_and_what_is_unstable():
    weak = LoopMargin("roll", 0.9, 1.5, 0.1, 3.0, 0.01)
    lines = loop_table([LawMargins("hover", "INDI", 1.01, (weak,))])
    assert lines[1].endswith("0.90 to 1.5     6°   3.0 rad/s   10 ms *")
    assert lines[2].endswith(f"unstable: growth {math.log(1.01) / PERIOD:.2f}/s")
