"""The reproduction of the report: its experiments, its verdicts, and the page that holds them."""

import json
import math
from html.parser import HTMLParser

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.airframe import load
from sitl.errors import SitlError
from sitl.kernels.hover_model import force_matrix, moment_matrix
from sitl.studies.report import SCENARIOS
from sitl.studies.reproduction import motors, redefinition, shapes
from sitl.studies.reproduction.catalogue import EXPERIMENTS, chosen, run_all
from sitl.studies.reproduction.errata import ERRATA
from sitl.studies.reproduction.experiment import Outcome, Panel, Row, Verdict, judge
from sitl.studies.reproduction.motors import Ending
from sitl.studies.reproduction.page import Provenance, number, page
from sitl.studies.scenario import SAMPLE, Figure, Track, fly
from sitl.vehicle import TICK, DivergedError

NOMINAL, FIRST_ORDER = load("nominal").parameters, load("nominal-first-order").parameters
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


# The studies


def test_the_straight_wing_of_the_comparison_is_the_hover_model():
    F, M = shapes.input_matrices(NOMINAL, shapes.STRAIGHT)
    assert pytest.approx(force_matrix(NOMINAL)) == F
    assert pytest.approx(moment_matrix(NOMINAL)) == M


def test_the_arc_pushes_sideways_by_what_c_y0_lets_it():
    a = NOMINAL._replace(C_y0=0.2)
    F, M = shapes.input_matrices(a, shapes.ARC)
    assert F[1, 2:] == pytest.approx([a.S_ratio * a.C_y0 * a.xi_f] * 2)
    assert F[[0, 2]] == pytest.approx(force_matrix(a)[[0, 2]])
    assert M[2, 2:] == pytest.approx([-a.S_ratio * a.b / a.c * a.C_y0 * a.xi_m * a.Delta_r] * 2)


def test_a_first_order_actuator_responds_by_its_closed_form():
    for which, tau in ((0, FIRST_ORDER.motor_tau), (2, FIRST_ORDER.elevon_tau)):
        gain, phase = motors.response(FIRST_ORDER, which, 0.1, 4.0)
        turn = 2.0 * math.pi * 4.0 * tau
        assert gain == pytest.approx(1.0 / math.hypot(1.0, turn), rel=0.01)
        assert phase == pytest.approx(-math.atan(turn), abs=0.02)


def test_a_rate_limited_actuator_follows_small_sines_and_makes_triangles_of_large_ones():
    amplitude, frequency = math.radians(29.0), 15.0
    small, _ = motors.response(NOMINAL, 2, math.radians(1.0), frequency)
    large, phase = motors.response(NOMINAL, 2, amplitude, frequency)
    assert small == pytest.approx(1.0, abs=0.01)
    triangle = 8.0 / math.pi**2 * NOMINAL.delta_rate / (4.0 * frequency * amplitude)
    assert large == pytest.approx(triangle, rel=0.02)
    assert -math.pi / 2 < phase < -1.2


def swinging(amplitude, frequency=1.0, decay=0.0, distance=1.0, diverged=""):
    time = np.arange(0.0, 20.0, SAMPLE * TICK)
    n = time.size
    zeros = np.zeros((n, 3))
    actuator = np.zeros((n, 4))
    actuator[:, 2] = amplitude * np.exp(-decay * time) * np.sin(2.0 * math.pi * frequency * time)
    p = zeros + np.array((distance, 0.0, 0.0))
    return Track(
        time=time, p=p, v=zeros, q=np.zeros((n, 4)), actuator=actuator, lyapunov=np.zeros(n), law=np.zeros(n),
        target=zeros, energy=np.zeros(n), guide=np.zeros((n, 5)), jumps=(), wall=1.0, diverged=diverged,
    )  # fmt: skip


def test_a_limit_cycle_is_what_neither_grows_nor_dies_and_stays_near():
    told = motors.oscillation(swinging(0.5, frequency=1.3))
    assert told.ending is Ending.CYCLE
    assert told.amplitude == pytest.approx(0.5, rel=0.01)
    assert told.frequency == pytest.approx(1.3, abs=0.06)
    assert motors.oscillation(swinging(0.5, decay=0.3)).ending is Ending.SETTLED
    assert motors.oscillation(swinging(0.005)).ending is Ending.SETTLED
    assert motors.oscillation(swinging(0.5, distance=80.0)).ending is Ending.LOST
    assert motors.oscillation(swinging(0.5, diverged="gone")).ending is Ending.LOST


def test_the_limit_cycle_needs_the_elevons_rate_limit_and_a_large_enough_step():
    made = motors.models()

    def ending(name, step):
        return motors.oscillation(motors.step_flight(made[name], 18.0, step, 1)).ending

    assert ending("saturated", 1.0) is ending("only the elevons' rate", 1.0) is Ending.CYCLE
    assert ending("first order", 1.0) is ending("only the motors' rate", 1.0) is Ending.SETTLED
    assert ending("saturated", 0.1) is Ending.SETTLED


def test_nu_prime_alone_makes_the_force_error_a_first_order_lag():
    lag = {prime: redefinition.lag_error(redefinition.lift(nu_prime=prime, duration=3.0)) for prime in (False, True)}
    assert lag[True] < 0.01
    assert lag[False] > 0.05


def test_a_flight_that_diverges_is_kept_up_to_there_when_asked():
    feather = NOMINAL._replace(J2=1e-9)  # turns faster than the steps can follow
    track = fly(SCENARIOS["hover"], airframe=feather, keep_diverged=True)
    assert "diverged" in track.diverged
    assert np.isfinite(track.p).all()
    assert track.time[-1] < SCENARIOS["hover"].duration - 1.0
    with pytest.raises(DivergedError):
        fly(SCENARIOS["hover"], airframe=feather)
