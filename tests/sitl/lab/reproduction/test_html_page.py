"""The reproduction of the report: its experiments and its page."""

import dataclasses
import math
from html.parser import HTMLParser

import pytest

from sitl.errors import SitlError
from sitl.lab.reproduction.errata import Erratum
from sitl.lab.reproduction.experiment import (
    OPEN_DIFFERENCES,
    EntryTable,
    ExperimentResult,
    Illustration,
    Panel,
    Recomputation,
    Statement,
    Verdict,
    failures,
    printed,
)
from sitl.lab.reproduction.experiments.experiment_list import EXPERIMENTS, chosen, run_all
from sitl.lab.reproduction.html_page import Provenance, cause_in_words, number, page
from sitl.lab.scenarios import SCENARIOS

PROVENANCE = Provenance("0", "none", 1, [("nominal", "abc")])
ERRATA = [Erratum("1", "wrong", "right", "none")]
VOID = {"meta", "br", "path", "use", "rect", "img"}


class Page(HTMLParser):
    """Parts of a page that a browser would use."""

    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.loads, self.open, self.cells = [], [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.ids += [given["id"]] if "id" in given else []
        self.links += [given["href"][1:]] if given.get("href", "").startswith("#") and tag == "a" else []
        self.loads += [v for k, v in attrs if k in {"src", "href", "xlink:href", "data"} and not v.startswith("#")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag


@pytest.fixture(scope="module")
def quick():
    names = ("limits", "matrices", "lqi-wind", "sigmoids", "hover", "vertical-plane", "straight-or-arc")
    experiments = chosen(names)
    return experiments, run_all(experiments, 1, 1, on_progress=str)


def statements_of(results):
    return [statement for result in results.values() for statement in result.statements]


@pytest.mark.long
def test_no_difference_is_unexplained_and_every_open_one_is_found(quick):
    statements = statements_of(quick[1])
    assert len(statements) > 35
    assert not [statement.name for statement in failures(statements)]
    assert all(statement.place and statement.expected.text for statement in statements)
    found = {statement.name for statement in statements if statement.verdict is Verdict.OPEN}
    assert found == set(OPEN_DIFFERENCES)


@pytest.mark.long
def test_a_computed_cause_changes_the_number_into_the_printed_one(quick):
    causes = [s for s in statements_of(quick[1]) if s.verdict is Verdict.CAUSE_COMPUTED]
    assert len(causes) > 10
    assert all(s.expected.holds(s.cause.value) and not s.expected.holds(s.value) for s in causes)


@pytest.mark.long
def test_both_printed_numbers_of_the_climb_belong_to_one_steady_flight(quick):
    nose, path = quick[1]["vertical-plane"].statements[:2]
    assert nose.cause.value == pytest.approx(54.2, abs=0.05)
    assert path.cause.value == pytest.approx(50.2, abs=0.05)
    assert (nose.verdict, path.verdict) == (Verdict.CAUSE_COMPUTED, Verdict.OPEN)


@pytest.mark.long
def test_the_page_loads_no_other_file_and_its_links_lead_somewhere(quick):
    text = page(*quick, ERRATA, PROVENANCE)
    read = Page(text)
    assert not read.open
    assert not read.loads
    assert len(set(read.ids)) == len(read.ids)
    assert set(read.links) <= set(read.ids)
    assert {experiment.name for experiment in quick[0]} <= set(read.links)
    assert "@import" not in text
    assert "url(http" not in text
    assert text.count("<style") == 1


@pytest.mark.long
def test_the_page_takes_its_colours_from_the_reader_s_theme(quick):
    text = page(*quick, ERRATA, PROVENANCE)
    assert "currentColor" in text
    assert "prefers-color-scheme: dark" in text
    assert "#010203" not in text


@pytest.mark.long
def test_one_seed_is_one_page_to_the_byte(quick):
    experiments = chosen(["sigmoids", "straight-or-arc"])
    apart = run_all(experiments, 1, 2, on_progress=str)
    together = {name: quick[1][name] for name in apart}
    assert page(experiments, apart, ERRATA, PROVENANCE) == page(experiments, together, ERRATA, PROVENANCE)


def test_the_figures_of_the_report_are_drawn_in_its_order(quick):
    numbers = [panel.number for result in quick[1].values() for panel in result.panels if panel.number]
    flown = ["3.2", "3.3", "3.4", "3.7", "3.8", "3.9", "3.10", "4.2", "4.3", "4.4", "4.5"]
    assert sorted(numbers) == sorted(flown)


OFF = Statement("1", "x", printed("1"), 2.0, "m", Recomputation("a slip", 2.5), note="a note")


def test_text_with_markup_characters_is_escaped():
    statement = dataclasses.replace(OFF, place="<b>", name="a & b", note="<script>")
    panel = Panel("1", '"caption" <i>', "claim", "seen", "<svg ></svg>")
    result = ExperimentResult([statement], [panel], [Illustration("<b>", "c < d", 1.0, "", "<u>", "")])
    text = page([EXPERIMENTS["sigmoids"]], {"sigmoids": result}, [Erratum("<q>", "", "", "")], PROVENANCE)
    assert "<script>" not in text
    assert "<q>" not in text
    assert "c &lt; d" in text
    assert "a &amp; b" in text
    assert "&lt;i&gt;" in text


def test_the_page_counts_verdicts_and_illustrations_apart():
    statements = [OFF, dataclasses.replace(OFF, value=1.2), dataclasses.replace(OFF, cause=Recomputation("s", 1.0))]
    result = ExperimentResult(statements, [], [Illustration("1", "y", 3.0, "", "", "")] * 2)
    text = page([EXPERIMENTS["sigmoids"]], {"sigmoids": result}, ERRATA, PROVENANCE)
    assert "3 statements: 1 reproduced, 1 differs, cause computed, 1 unexplained." in text
    assert "And 2 illustrations" in text


def test_several_statements_differ_and_a_long_word_does_not_widen_the_page():
    caused = dataclasses.replace(OFF, cause=Recomputation("s", 1.0))
    text = page([EXPERIMENTS["sigmoids"]], {"sigmoids": ExperimentResult([caused] * 2, [], [])}, ERRATA, PROVENANCE)
    assert "2 statements: 2 differ, cause computed." in text
    assert "overflow-wrap: anywhere" in text


def test_an_unexplained_difference_says_what_was_tried():
    assert cause_in_words(OFF) == "not explained by: 2.5 m with: a slip. a note"
    assert cause_in_words(dataclasses.replace(OFF, cause=None)) == "not explained. a note"


def test_a_cause_is_shown_only_where_the_number_differs():
    assert cause_in_words(dataclasses.replace(OFF, value=1.0)) == "a note"
    found = dataclasses.replace(OFF, cause=Recomputation("a slip", 1.1), note="")
    assert cause_in_words(found) == "1.1 m with: a slip"


def test_an_open_difference_is_listed_with_both_numbers():
    name, difference = next(iter(OPEN_DIFFERENCES.items()))
    value = 0.5 * (difference.found.low + difference.found.high)
    result = ExperimentResult([Statement("3.2", name, printed("9"), value)], [])
    text = page([EXPERIMENTS["sigmoids"]], {"sigmoids": result}, ERRATA, PROVENANCE)
    assert "Open differences: 1" in text
    assert difference.why_open[:40] in text


def test_tables_of_entries_are_on_the_page():
    result = ExperimentResult([], [], [], [EntryTable("A matrix", ("entry", "report"), [("A(1, 2)", "0.92")])])
    text = page([EXPERIMENTS["sigmoids"]], {"sigmoids": result}, ERRATA, PROVENANCE)
    assert "<summary>A matrix</summary>" in text
    assert "<td>0.92</td>" in text


@pytest.mark.parametrize(
    ("value", "text"),
    [(3.0, "3"), (0.12345, "0.1235"), (math.nan, "never"), (math.inf, "infinite"), (1.2e-9, "< 0.0001")],
)
def test_numbers_read_as_numbers(value, text):
    assert number(value) == text


def test_every_flight_of_the_report_has_its_experiment():
    assert set(SCENARIOS) - {"jet-gust"} <= set(EXPERIMENTS)  # which is none of the report's


def test_an_unknown_experiment_is_an_error():
    with pytest.raises(SitlError, match="no experiment 'x'"):
        chosen(["hover", "x"])
