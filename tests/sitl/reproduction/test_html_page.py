"""The reproduction of the report: its experiments, its verdicts, and its page."""

import math
from html.parser import HTMLParser

import pytest

from sitl.errors import SitlError
from sitl.reproduction.errata import ERRATA
from sitl.reproduction.experiment import ExperimentResult, Panel, Statement, Verdict, judge
from sitl.reproduction.experiments.experiment_list import EXPERIMENTS, chosen, run_all
from sitl.reproduction.html_page import Provenance, number, page
from sitl.scenarios.catalogue import SCENARIOS
from sitl.scenarios.scenario import Finding

PROVENANCE = Provenance("0", "none", 1, [("nominal", "abc")])
VOID = {"meta", "br", "path", "use", "rect", "img"}


class Page(HTMLParser):
    """What a browser would take from a page."""

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
    names = ("matrices", "lqi-wind", "sigmoids", "hover", "vertical-plane", "straight-or-arc")
    experiments = chosen(names)
    return experiments, run_all(experiments, 1, 1, on_progress=str)


def test_every_difference_has_a_cause(quick):
    _, results = quick
    statements = [statement for result in results.values() for statement in result.statements]
    assert len(statements) > 50
    assert not [statement.finding.name for statement in statements if not statement.is_explained]
    assert all(statement.place and statement.finding.expected for statement in statements)


def test_a_value_computed_with_a_slip_left_in_says_with_which(quick):
    _, results = quick
    typed = [
        statement
        for result in results.values()
        for statement in result.statements
        if statement.verdict is Verdict.AS_TYPED
    ]
    assert typed
    assert all(statement.cause for statement in typed)


def test_the_two_printed_numbers_of_the_forward_flight_come_out_of_the_swapped_pitch_moment(quick):
    verdicts = {statement.finding.name: statement.verdict for statement in quick[1]["vertical-plane"].statements}
    assert verdicts["pitch as typed, after 30 s"] is verdicts["motors as typed, after 30 s"] is Verdict.AS_TYPED
    assert verdicts["pitch, corrected"] is verdicts["motors, corrected"] is Verdict.DIFFERS


def test_the_page_loads_no_other_file_and_its_links_lead_somewhere(quick):
    text = page(*quick, PROVENANCE)
    read = Page(text)
    assert not read.open
    assert not read.loads
    assert len(set(read.ids)) == len(read.ids)
    assert set(read.links) <= set(read.ids)
    assert {experiment.name for experiment in quick[0]} <= set(read.links)
    assert "@import" not in text
    assert "url(http" not in text
    assert text.count("<style") == 1


def test_the_page_takes_its_colours_from_the_reader_s_theme(quick):
    text = page(*quick, PROVENANCE)
    assert "currentColor" in text
    assert "prefers-color-scheme: dark" in text
    assert "#010203" not in text


def test_one_seed_is_one_page_to_the_byte(quick):
    experiments = chosen(["sigmoids", "straight-or-arc"])
    apart = run_all(experiments, 1, 2, on_progress=str)
    together = {name: quick[1][name] for name in apart}
    assert page(experiments, apart, PROVENANCE) == page(experiments, together, PROVENANCE)


def test_the_figures_of_the_report_are_drawn_in_its_order(quick):
    numbers = [panel.number for result in quick[1].values() for panel in result.panels if panel.number]
    flown = ["3.2", "3.3", "3.4", "3.7", "3.8", "3.9", "3.10", "4.2", "4.3", "4.4", "4.5", "C.1"]
    assert sorted(numbers) == sorted(flown)


def test_text_with_markup_characters_is_escaped():
    statement = Statement("<b>", Finding("a & b", 1.0, "m", "< 1", holds=False), Verdict.DIFFERS, "<script>")
    panel = Panel("1", '"caption" <i>', "claim", "seen", "<svg ></svg>")
    text = page([EXPERIMENTS["sigmoids"]], {"sigmoids": ExperimentResult([statement], [panel])}, PROVENANCE)
    assert "<script>" not in text
    assert "a &amp; b" in text
    assert "&lt;i&gt;" in text


def test_a_difference_without_a_cause_is_shown_as_unexplained():
    statement = judge("1", Finding("x", 2.0, "", "1", holds=False))
    assert not statement.is_explained
    assert "not explained" in page([EXPERIMENTS["nu"]], {"nu": ExperimentResult([statement], [])}, PROVENANCE)


@pytest.mark.parametrize(
    ("holds", "slip", "verdict"),
    [
        (True, False, Verdict.REPRODUCED),
        (True, True, Verdict.AS_TYPED),
        (False, False, Verdict.DIFFERS),
        (False, True, Verdict.DIFFERS),
    ],
)
def test_the_verdict_follows_the_measurement(holds, slip, verdict):
    assert judge("1", Finding("x", 0.0, "", "0", holds=holds), "why", slip=slip).verdict is verdict


@pytest.mark.parametrize(
    ("value", "text"),
    [(3.0, "3"), (0.1234, "0.123"), (math.nan, "never"), (math.inf, "infinite"), (1.2e-9, "< 0.0001")],
)
def test_numbers_read_as_numbers(value, text):
    assert number(value) == text


def test_every_erratum_is_complete_and_stands_once():
    assert all(all(cell.strip() for cell in erratum) for erratum in ERRATA)
    assert len({(erratum.place, erratum.printed) for erratum in ERRATA}) == len(ERRATA)


def test_every_flight_of_the_report_has_its_experiment():
    assert set(SCENARIOS) <= set(EXPERIMENTS)


def test_an_unknown_experiment_is_an_error():
    with pytest.raises(SitlError, match="no experiment 'x'"):
        chosen(["hover", "x"])
