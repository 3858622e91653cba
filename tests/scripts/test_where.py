"""``scripts/where.py`` answers a newcomer's questions with places, best first, and says where nothing is."""

from pathlib import Path

import pytest

from scripts.finding.answer import MOST, WIDTH, main
from scripts.finding.search import search
from scripts.finding.tree import ROOT, places
from scripts.finding.words import asked, stem

QUESTIONS = [
    line.split(" -> ") for line in Path(__file__).with_name("questions.txt").read_text(encoding="utf-8").splitlines()
]
NEAR_THE_TOP = 5  # lines that are read at a glance


def rank(question, answer):
    """The line of the answer on which a place stands, from 1."""
    lines = [f"{hit.place.path} {hit.place.name}".strip() for hit in search(question.split())]
    return lines.index(answer) + 1 if answer in lines else MOST + 1


@pytest.mark.long
@pytest.mark.parametrize(("question", "answer"), QUESTIONS, ids=[question for question, _ in QUESTIONS])
def test_a_newcomers_question_is_answered_near_the_top(question, answer):
    assert rank(question, answer) <= NEAR_THE_TOP


@pytest.mark.long
def test_most_questions_are_answered_by_the_first_or_the_second_line():
    ranks = [rank(question, answer) for question, answer in QUESTIONS]
    assert len(ranks) > 60
    assert sum(it <= 2 for it in ranks) > 0.8 * len(ranks)


@pytest.mark.long
def test_an_answer_says_where_what_it_is_worth_and_what_it_means(capsys):
    assert main(["link", "lost", "timeout"]) == 0
    first, *others = capsys.readouterr().out.splitlines()
    assert first.startswith("sitl/autopilot/settings.py:")
    assert first.endswith("Settings.link_timeout = 10.0  COM_DL_LOSS_T s The ground station is lost after this silence")
    assert len(others) < MOST
    assert all(len(line) <= WIDTH for line in others)
    path, line = first.partition("  ")[0].split(":")
    assert "link_timeout" in (ROOT / path).read_text(encoding="utf-8").splitlines()[int(line) - 1]


def test_a_word_that_is_nowhere_ends_with_1_and_prints_nothing(capsys):
    assert main(["nosuchwordanywhere"]) == 1
    assert capsys.readouterr().out == ""


@pytest.mark.long
def test_where_nothing_has_every_word_the_one_that_is_missing_is_said(capsys):
    assert main(["caught", "fall", "nosuchwordanywhere"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any("supervisor/guards.py" in line and "(without nosuchwordanywhere) caught" in line for line in lines)


@pytest.mark.long
def test_many_places_are_cut_to_ten_lines_and_counted(capsys):
    assert main(["vehicle"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == MOST
    assert lines[-1].startswith("and ")


def test_every_file_says_what_it_holds():
    """But for those that are empty, or the way into a package."""
    assert [place.path for place in places() if not place.name and not place.about if "__" not in place.path] == []


@pytest.mark.parametrize(
    "words",
    [
        ("landed", "landing", "lands", "land"),
        ("stopped", "stopping", "stops"),
        ("refused", "refusing", "refuse"),
        ("batteries", "battery"),
        ("touches", "touch"),
        ("estimated", "estimate", "estimator", "estimation"),
        ("filtered", "filters", "filter"),
    ],
)
def test_endings_do_not_matter(words):
    assert len({stem(word) for word in words}) == 1


def test_different_words_keep_different_stems():
    words = ("speed", "spin", "loss", "lost", "wing", "wind", "motor", "mode", "pass", "path", "rate", "ratio")
    assert len({stem(word) for word in words}) == len(words)


def test_words_that_say_nothing_are_left_out_unless_nothing_else_is_asked():
    assert asked(["effect", "of", "an", "Elevon"]) == ["effect", "elevon"]
    assert asked(["of"]) == ["of"]


def test_a_name_that_is_asked_for_is_its_parts_and_a_hyphen_joins():
    assert asked(["take-off", "MPC_LAND_SPEED", "wingShape"]) == ["takeoff", "mpc", "land", "speed", "wing", "shape"]
