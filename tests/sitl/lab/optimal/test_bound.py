"""Bounds of legs: checked against the plant, kept by their question, and refused in one line."""

import json
import math

import numpy as np
import pytest

from sitl import SitlError, load_airframe

pytest.importorskip("casadi")
bound = pytest.importorskip("sitl.lab.optimal.bound")
leg_problem = pytest.importorskip("sitl.lab.optimal.leg_problem")
question = pytest.importorskip("sitl.lab.optimal.question")

ASKED = question.Question(airframe="collage", distance=30.0, time_price=0.0)


@pytest.fixture
def coarse(monkeypatch):
    """Meshes that take a second."""
    monkeypatch.setattr(bound, "MESH_INTERVALS", {False: (16, 24, 32), True: (10, 14, 18)})


def answered(asked, folder):
    return bound.find_bound(asked, question.AnswerFolder(folder), quiet=True)


@pytest.mark.long
def test_least_energy_is_that_of_an_independent_collocation_and_is_what_the_plant_flies(coarse, tmp_path):
    found = answered(ASKED, tmp_path)
    assert found.energy == pytest.approx(415.0, rel=0.02)  # audit of 2026-11, 140 intervals of another text
    assert found.agrees
    assert max(found.guesses_apart, found.meshes_apart) < 0.01
    assert found.defects.position < 1e-3
    assert found.defects.attitude < math.radians(1.0)
    assert dict(found.open_loop)[0.5].position < 0.02
    assert found.plant[0, :3] == pytest.approx([0.0, 0.0, 50.0], abs=1e-6)
    assert found.plant[-1, :6] == pytest.approx([30.0, 0.0, 50.0, 0.0, 0.0, 0.0], abs=1e-3)
    a = load_airframe("collage").parameters
    assert found.plant[:, 13].min() >= a.omega_min - 1.0
    assert np.abs(found.plant[:, 15]).max() <= a.delta_max + 0.01
    text = "\n".join(bound.as_lines(found))
    assert "apart: two guesses 0." in text
    assert "without correction" in text


@pytest.mark.long
def test_space_finds_what_the_plane_finds_and_leaving_a_share_costs(coarse, tmp_path):
    plane = answered(ASKED._replace(distance=10.0), tmp_path)
    space = answered(ASKED._replace(distance=10.0, in_space=True), tmp_path)
    left = answered(ASKED._replace(distance=10.0, share_left=0.3), tmp_path)
    assert space.energy == pytest.approx(plane.energy, rel=0.02)
    assert left.energy > plane.energy
    assert np.abs(left.plant[:, 15]).max() <= 0.7 * load_airframe("collage").parameters.delta_max + 0.01


@pytest.mark.long
def test_an_answer_is_kept_and_a_damaged_one_found_anew(coarse, tmp_path, monkeypatch):
    asked = ASKED._replace(distance=10.0)
    first = answered(asked, tmp_path)
    (kept,) = tmp_path.glob("*.json")
    assert kept.stem == asked.key()
    with monkeypatch.context() as patched:
        patched.setattr(bound, "leg_problem", lambda _: pytest.fail("solved again"))
        again = answered(asked, tmp_path)
    assert (again.time, again.energy, again.tries) == (first.time, first.energy, first.tries)
    assert np.array_equal(again.plant, first.plant)
    kept.write_text('{"time": 1.0}')
    assert answered(asked, tmp_path).energy == pytest.approx(first.energy)
    assert json.loads(kept.read_text())["energy"] == pytest.approx(first.energy)


def test_guesses_and_meshes_are_compared_where_the_best_two_went_farthest():
    def tried(*costs):
        tries = (bound.Try(name, intervals, cost, 9, "") for name, intervals, cost in costs)
        nothing = np.zeros(0)
        gap = bound.Gap(0.0, 0.0, 0.0, 0.0)
        return bound.Bound(ASKED, 1.0, 1.0, tuple(tries), gap, (), nothing, nothing, nothing)

    rough = (("a", 40, 9.0), ("b", 40, 9.5))
    found = tried(*rough, ("a", 60, 8.2), ("b", 60, 8.0), ("b", 90, 7.95), ("a", 90, 7.99))
    assert found.guesses_apart == pytest.approx(7.99 / 7.95 - 1.0)
    assert found.meshes_apart == pytest.approx(8.0 / 7.95 - 1.0)
    assert found.agrees
    assert not tried(*rough, ("a", 60, 8.0), ("b", 60, 8.2), ("a", 90, 7.95)).agrees  # the guesses differ
    assert not tried(*rough, ("a", 60, 8.1), ("b", 60, 8.1), ("a", 90, 7.95)).agrees  # the meshes do
    assert not tried(*rough).agrees
    assert not tried(*rough, ("a", 60, 8.0), ("a", 90, 7.96), ("a", 90, 7.95)).agrees  # one guess, solved twice


def test_easier_questions_have_a_price_of_time_and_more_of_the_actuators():
    quick = ASKED._replace(time_price=math.inf, share_left=0.3)
    assert bound.related_questions(quick) == [
        ("as with 300 W of time", quick._replace(time_price=300.0)),
        ("as with 15% left", quick._replace(share_left=0.15)),
    ]
    assert bound.related_questions(ASKED) == [("as with 30 W of time", ASKED._replace(time_price=30.0))]


@pytest.mark.long
def test_what_too_few_iterations_leave_open_is_sought_again_with_more(monkeypatch, tmp_path):
    monkeypatch.setattr(bound, "MESH_INTERVALS", {False: (16, 24, 32), True: (10, 14, 18)})
    monkeypatch.setattr("sitl.lab.optimal.collocation.MOST_ITERATIONS", 12)
    monkeypatch.setattr("sitl.lab.optimal.collocation.MOST_NEARBY", 12)
    monkeypatch.setattr(bound, "MORE_PATIENCE", 1)
    with pytest.raises(SitlError, match="no optimum found"):
        answered(ASKED, tmp_path)
    monkeypatch.setattr(bound, "MORE_PATIENCE", 12)
    found = answered(ASKED, tmp_path)
    assert math.isfinite(found.energy)
    assert any(one.guess == "as with 30 W of time" and one.iterations > 12 for one in found.tries)


def test_a_key_is_of_the_question_and_of_the_airframe():
    keys = {asked.key() for asked in (ASKED, ASKED._replace(climb=1.0), ASKED._replace(airframe="darko"))}
    assert len(keys) == 3
    assert ASKED.key() == question.Question(airframe="collage", distance=30.0, time_price=0.0).key()


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"distance": 2000.0}, "distance 2000 is not from 0 to 1000 m"),
        ({"tail_wind": 8.0, "cross_wind": 8.0}, "wind 11.3137 is not from 0 to 10 m/s"),
        ({"share_left": 0.9}, "share left 0.9 is not from 0 to 0.8"),
        ({"room": (-1.0, 8.0)}, "neither may be negative"),
        ({"nose": (-60.0, 80.0)}, "nose from -60 to 80 deg"),
        ({"cross_wind": 5.0, "sideways": 4.0}, "air from the side 4 is not from 5 to 25 m/s"),
        ({"distance": 0.0}, "the leg ends where and as it begins"),
        (
            {"arena": "voliere", "distance": 30.0, "place": (0.0, 0.0, 3.0)},
            "the end of the leg: .* is outside the arena",
        ),
        ({"end": "cruise", "airspeed": 6.0, "share_left": 0.7}, "the end's trim needs more than the actuators give"),
    ],
)
def test_a_question_without_an_answer_is_refused_in_one_line(changed, words):
    with pytest.raises(SitlError, match=words) as told:
        leg_problem.leg_problem(ASKED._replace(**changed))
    assert "\n" not in str(told.value)


@pytest.mark.long
def test_a_leg_that_no_guess_solves_says_why_for_each(monkeypatch, tmp_path):
    monkeypatch.setattr(bound, "MESH_INTERVALS", {False: (6, 8), True: (6, 8)})
    monkeypatch.setattr("sitl.lab.optimal.collocation.MOST_ITERATIONS", 2)
    with pytest.raises(
        SitlError, match="no optimum found for 30 m, least energy: guess 'as a wing': maximum iter"
    ) as told:
        answered(ASKED, tmp_path)
    assert "guess 'upright'" in str(told.value)
    assert not list(tmp_path.iterdir())


def test_trims_hold_the_plant_in_any_wind():
    a = load_airframe("darko").parameters
    for wind, airspeed, heading in (((0.0, 4.0), 0.0, 0.0), ((-5.0, 0.0), 0.0, math.pi), ((2.0, -3.0), 15.0, 0.5)):
        air = leg_problem.Vector(*wind, 0.0)
        state = leg_problem.trimmed(a, air, airspeed, heading)
        rates, _ = leg_problem.plant_function(a, air)(state)
        assert np.abs(np.asarray(rates).ravel()[3:]).max() < 1e-5
        assert np.linalg.norm(state[3:5] - np.array(wind) * (airspeed > 0.0)) == pytest.approx(airspeed, abs=1e-9)
