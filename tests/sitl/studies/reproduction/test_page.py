"""The reproduction of the report: its experiments, its verdicts, and the page that holds them."""

import json
import math
from html.parser import HTMLParser

import pytest

from sitl.__main__ import main
from sitl.errors import SitlError
from sitl.studies.report import SCENARIOS
from sitl.studies.reproduction.catalogue import EXPERIMENTS, chosen, run_all
from sitl.studies.reproduction.errata import ERRATA
from sitl.studies.reproduction.experiment import Outcome, Panel, Row, Verdict, judge
from sitl.studies.reproduction.page import Provenance, number, page
from sitl.studies.scenario import Figure

MADE = Provenance("0", "none", 1, [("nominal", "abc")])
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
    return experiments, run_all(experiments, 1, 1, say=str)


def test_every_difference_has_a_cause(quick):
    _, outcomes = quick
    rows = [row for outcome in outcomes.values() for row in outcome.rows]
    assert len(rows) > 50
    assert not [row.figure.name for row in rows if not row.explained]
    assert all(row.place and row.figure.expected for row in rows)


def test_a_value_got_with_a_slip_left_in_says_which(quick):
    _, outcomes = quick
    typed = [row for outcome in outcomes.values() for row in outcome.rows if row.verdict is Verdict.AS_TYPED]
    assert typed
    assert all(row.cause for row in typed)


def test_the_two_printed_numbers_of_the_forward_flight_come_out_of_the_swapped_pitch_moment(quick):
    verdicts = {row.figure.name: row.verdict for row in quick[1]["vertical-plane"].rows}
    assert verdicts["pitch as typed, after 30 s"] is verdicts["motors as typed, after 30 s"] is Verdict.AS_TYPED
    assert verdicts["pitch, corrected"] is verdicts["motors, corrected"] is Verdict.DIFFERS


def test_the_page_needs_nothing_beside_itself_and_its_links_lead_somewhere(quick):
    text = page(*quick, MADE)
    read = Page(text)
    assert not read.open
    assert not read.loads
    assert len(set(read.ids)) == len(read.ids)
    assert set(read.links) <= set(read.ids)
    assert {experiment.name for experiment in quick[0]} <= set(read.links)
    assert "@import" not in text
    assert "url(http" not in text
    assert text.count("<style") == 1


def test_the_page_takes_its_ink_from_the_reader_s_theme(quick):
    text = page(*quick, MADE)
    assert "currentColor" in text
    assert "prefers-color-scheme: dark" in text
    assert "#010203" not in text


def test_one_seed_is_one_page_to_the_byte(quick):
    experiments = chosen(["sigmoids", "straight-or-arc"])
    apart = run_all(experiments, 1, 2, say=str)
    together = {name: quick[1][name] for name in apart}
    assert page(experiments, apart, MADE) == page(experiments, together, MADE)


def test_the_figures_of_the_report_are_drawn_in_its_order(quick):
    numbers = [panel.number for outcome in quick[1].values() for panel in outcome.panels if panel.number]
    flown = ["3.2", "3.3", "3.4", "3.7", "3.8", "3.9", "3.10", "4.2", "4.3", "4.4", "4.5", "C.1"]
    assert sorted(numbers) == sorted(flown)


def test_text_is_text_and_not_markup():
    row = Row("<b>", Figure("a & b", 1.0, "m", "< 1", holds=False), Verdict.DIFFERS, "<script>")
    panel = Panel("1", '"caption" <i>', "claim", "seen", "<svg ></svg>")
    text = page([EXPERIMENTS["sigmoids"]], {"sigmoids": Outcome([row], [panel])}, MADE)
    assert "<script>" not in text
    assert "a &amp; b" in text
    assert "&lt;i&gt;" in text


def test_a_difference_without_a_cause_is_shown_as_unexplained():
    row = judge("1", Figure("x", 2.0, "", "1", holds=False))
    assert not row.explained
    assert "not explained" in page([EXPERIMENTS["nu"]], {"nu": Outcome([row], [])}, MADE)


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
    assert judge("1", Figure("x", 0.0, "", "0", holds=holds), "why", slip=slip).verdict is verdict


@pytest.mark.parametrize(
    ("value", "text"),
    [(3.0, "3"), (0.1234, "0.123"), (math.nan, "never"), (math.inf, "infinite"), (1.2e-9, "< 0.0001")],
)
def test_numbers_read_as_numbers(value, text):
    assert number(value) == text


def test_errata_are_whole_and_told_once():
    assert all(all(cell.strip() for cell in erratum) for erratum in ERRATA)
    assert len({(erratum.place, erratum.printed) for erratum in ERRATA}) == len(ERRATA)


def test_every_flight_of_the_report_has_its_experiment():
    assert set(SCENARIOS) <= set(EXPERIMENTS)


# The command


def test_the_command_writes_a_page_and_nothing_else(tmp_path, capsys):
    path = tmp_path / "page.html"
    assert main(["report", "--only", "sigmoids", "-o", str(path), "--jobs", "1"]) == 0
    assert capsys.readouterr().out.strip() == str(path)
    assert list(tmp_path.iterdir()) == [path]
    assert "Gompertz" in path.read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--only", "nothing"], "no experiment 'nothing': there are matrices"),
        (["--jobs", "0"], "--jobs 0: at least one"),
        (["-o", "nowhere/page.html"], "there is no folder nowhere"),
    ],
)
def test_a_mistaken_command_is_one_line(arguments, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["report", *arguments]) == 2
    told = capsys.readouterr().err.strip()
    assert message in told
    assert "\n" not in told


def test_a_page_that_cannot_be_written_leaves_no_trace(tmp_path, capsys):
    taken = tmp_path / "page.html"
    taken.mkdir()
    assert main(["report", "--only", "sigmoids", "-o", str(taken), "--jobs", "1"]) == 2
    assert "page.html" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [taken]


def test_a_study_runs_alone_by_its_name(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["scenario", "straight-or-arc"]) == 0
    assert "hover: largest difference" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ["straight-or-arc-1.svg"]
    assert main(["scenario", "sigmoids", "--json", "--no-plot"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert {figure["verdict"] for figure in told["figures"]} == {"reproduced", "differs"}


def test_an_unknown_experiment_is_an_error():
    with pytest.raises(SitlError, match="no experiment 'x'"):
        chosen(["hover", "x"])
