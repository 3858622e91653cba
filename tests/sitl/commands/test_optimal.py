"""``darko-sitl optimal``: its arguments, its table, and what is said where CasADi is missing."""

import json
import math

import numpy as np
import pytest

from sitl.commands import optimal
from sitl.errors import SitlError

OPTIONS = optimal.parser({"optimal": ""})


def test_without_casadi_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr(optimal, "find_spec", lambda _: None)
    with pytest.raises(SitlError, match=r"^darko-sitl optimal needs CasADi: pip install 'darko\[optimal\]'$"):
        optimal.run(OPTIONS.parse_args(["leg", "30"]))


@pytest.fixture
def yardstick():
    pytest.importorskip("casadi")
    return pytest.importorskip("sitl.lab.optimal.yardstick")


def asked(yardstick, *words):
    return yardstick.question_of(OPTIONS.parse_args(["leg", *words]))


def test_arguments_make_the_question(yardstick):
    found = asked(yardstick, "100", "--climb", "-20", "--turn", "90", "--tail", "-5", "--price", "50", "--end", "point")
    assert found == found._replace(distance=100.0, climb=-20.0, tail_wind=-5.0, time_price=50.0, end="point")
    assert found.turn == pytest.approx(0.5 * math.pi)
    assert not found.is_planar
    assert math.isinf(asked(yardstick, "30").time_price)
    assert asked(yardstick, "30", "--energy").time_price == 0.0
    assert asked(yardstick, "30").is_planar
    assert not asked(yardstick, "30", "--space").is_planar
    with pytest.raises(SitlError, match="--energy and --price: give one of them"):
        asked(yardstick, "30", "--energy", "--price", "5")


def test_rows_of_the_table_are_legs_and_others_are_refused(yardstick):
    assert yardstick.row_question("up-30", "darko").climb == 20.0
    assert yardstick.row_question("turn180-300", "darko").turn == pytest.approx(math.pi)
    assert len(yardstick.ROW_NAMES) == 40
    for name in ("up-31", "sideways-30", "level"):
        with pytest.raises(SitlError, match=f"the table has no row '{name}'; it has level, up, down"):
            optimal.run(OPTIONS.parse_args(["table", name]))


def bound_of(yardstick, time, energy, **changed):
    """A bound along 30 m at an even speed and power, agreed on."""
    from sitl.lab.optimal import bound

    gap, times = bound.Gap(0.0, 0.0, 0.0, 0.0), np.linspace(0.0, time, 50)
    plant = np.zeros((50, 17))
    plant[:, 0], plant[:, 6] = np.linspace(0.0, 30.0, 50), 1.0
    tries = tuple(bound.Try(guess, n, time, 9, "") for guess, n in (("a", 8), ("a", 9), ("b", 9), ("a", 12)))
    leg = yardstick.row_question("level-30", "collage")._replace(**changed)
    return bound.Bound(leg, time, energy, tries, gap, ((0.5, gap),), times, plant, np.full(50, energy / time))


def flight_of(time, energy):
    from sitl.lab.optimal.flown_leg import WAYS, LegFlight

    times, plant = np.linspace(0.0, time, 40), np.zeros((40, 17))
    plant[:, 0], plant[:, 6] = np.linspace(0.0, 30.0, 40), 1.0
    return LegFlight("indi", WAYS[0], time, energy, times, plant, np.linspace(0.0, energy, 40))


def test_the_table_has_ratios_and_stretches(yardstick):
    bounds = {(math.inf, 0.0): bound_of(yardstick, 3.0, 500.0), (math.inf, yardstick.LEFT): None}
    bounds |= {(0.0, 0.0): bound_of(yardstick, 4.0, 400.0), (0.0, yardstick.LEFT): bound_of(yardstick, 5.0, 500.0)}
    row = yardstick.TableRow("level-30", bounds, [flight_of(9.0, 900.0), flight_of(6.0, 1000.0)], ["no optimum"])
    head, _, cells, *rest = yardstick.table_lines([row], ["indi"])
    assert head == "| leg | least time (30% left) [s] | indi [s] | least energy (30% left) [J] | indi [J] |"
    assert cells == (
        "| level-30 | 3.00 (-) | 6.00 upright 3 m/s: **2.00** (-) | 400 (500) | 900 upright 3 m/s: **2.25** (1.80) |"
    )
    assert [line.split()[0] for line in rest[2:4]] == ["least", "indi"]
    assert rest[3].count(" J") == 3
    assert rest[-1] == "level-30: no optimum"
    plain = yardstick._plain(row)
    assert json.dumps(plain)
    assert len(plain["bounds"]) == 3


def test_a_leg_is_cut_where_it_is_ten_metres_from_its_ends():
    pytest.importorskip("casadi")
    from sitl.lab.optimal.flown_leg import stretches

    times, north = np.arange(11.0), np.array([0.0, 5.0, 9.0, 12.0, 50.0, 85.0, 91.0, 95.0, 99.0, 100.0, 100.0])
    parts = stretches(times, north, 10.0 * times, 100.0)
    assert [tuple(part) for part in parts] == [(3.0, 30.0), (3.0, 30.0), (4.0, 40.0)]
    short = stretches(times, 0.06 * north, 10.0 * times, 6.0)  # a third each
    assert [tuple(part) for part in short] == [(4.0, 40.0), (1.0, 10.0), (5.0, 50.0)]


def test_a_bound_that_does_not_agree_with_itself_is_marked(yardstick):
    one = bound_of(yardstick, 3.0, 500.0)
    off = one._replace(tries=(*one.tries[:-1], one.tries[-1]._replace(cost=3.2)))
    assert one.agrees
    assert not off.agrees
    assert not one._replace(tries=one.tries[:2]).agrees
    row = yardstick.TableRow(
        "level-30", dict.fromkeys([(p, s) for p in (math.inf, 0.0) for s in (0.0, 0.3)], off), [], []
    )
    assert "3.00* (3.00*)" in yardstick.table_lines([row], [])[2]


def test_a_front_tells_what_a_second_costs(yardstick):
    front = [bound_of(yardstick, 4.0, 400.0, time_price=0.0), bound_of(yardstick, 3.0, 460.0)]
    _, first, last = yardstick.front_lines(front)
    assert first.split() == ["0", "4.00", "400", "-"]
    assert last.split() == ["least", "time", "3.00", "460", "60"]


@pytest.mark.long
@pytest.mark.parametrize("suffix", [".html", ".png"])
def test_the_page_shows_bound_and_flight(yardstick, tmp_path, suffix):
    path = tmp_path / f"leg{suffix}"
    yardstick.check_page(path)
    yardstick.write_page([bound_of(yardstick, 3.0, 500.0)], [flight_of(6.0, 900.0)], path)
    assert path.stat().st_size > 10_000
    if suffix == ".html":
        text = path.read_text()
        assert "<svg" in text
        assert "indi, upright 3 m/s" in text


def test_a_page_that_cannot_be_written_is_refused_before_the_work(yardstick, tmp_path):
    for path, words in (("leg.txt", "must end in .html"), ("nosuch/leg.html", "there is no folder")):
        with pytest.raises(SitlError, match=words):
            optimal.run(OPTIONS.parse_args(["leg", "30", "--plot", str(tmp_path / path)]))
    with pytest.raises(SitlError, match="there is no folder"):
        optimal.run(OPTIONS.parse_args(["table", "level-30", "--results", str(tmp_path / "nosuch" / "r.json")]))
