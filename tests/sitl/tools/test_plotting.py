"""Plots need matplotlib, an optional dependency: without it a command says so at once, in one line."""

import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from sitl.__main__ import main
from sitl.errors import SitlError
from sitl.lab.reproduction.flight_panels import SvgSheet
from sitl.tools.plotting import MissingMatplotlibError, blank_page, check_plot_path, mermaid, save_page

MESSAGE = "darko-sitl: plotting needs matplotlib: pip install 'darko[plots]'\n"


@pytest.fixture
def no_matplotlib(monkeypatch):
    """An environment in which matplotlib is not installed."""
    for name in [name for name in sys.modules if name.partition(".")[0] in {"matplotlib", "cycler"}]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)


@pytest.mark.usefixtures("no_matplotlib")
@pytest.mark.parametrize(
    "arguments",
    [
        ["study", "scenario", "hover"],
        ["study", "scenario", "sigmoids", "--no-plot"],  # experiments draw their panels in any case
        ["study", "report"],
        ["study", "campaign", "--plot", "plot.png"],
        ["study", "breakeven", "--plot", "plot.png"],
        ["study", "region", "--plot", "plot.png"],
        ["airframe", "nominal", "--trims", "--plot", "plot.png"],
    ],
    ids=" ".join,
)
def test_without_matplotlib_a_command_that_plots_says_what_to_install(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    assert tuple(capsys.readouterr()) == ("", MESSAGE)
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("no_matplotlib")
@pytest.mark.parametrize(
    "arguments",
    [["study", "scenario", "hover", "--no-plot"], ["airframe", "nominal", "--trims"], ["study", "scenario"]],
)
def test_without_matplotlib_a_command_that_only_prints_works(arguments, capsys):
    assert main(arguments) == 0
    assert not capsys.readouterr().err


@pytest.mark.usefixtures("no_matplotlib")
def test_without_matplotlib_no_page_can_be_begun():
    with pytest.raises(MissingMatplotlibError):
        blank_page(4.0, 3.0)
    with pytest.raises(MissingMatplotlibError):
        SvgSheet("panel")


@pytest.mark.parametrize(
    ("path", "problem"),
    [("nowhere/plot.png", "there is no folder nowhere"), ("plot.txt", "must end in .png, .svg, .pdf")],
)
def test_a_path_that_cannot_be_plotted_to_is_refused_beforehand(path, problem):
    with pytest.raises(SitlError, match=problem):
        check_plot_path(Path(path))


def test_a_page_that_cannot_be_written_is_an_error_with_its_path(tmp_path):
    with pytest.raises(SitlError, match=r"plot .*page\.png"):
        save_page(blank_page(4.0, 3.0), tmp_path / "nowhere" / "page.png", dpi=50)


# Tables of jumps drawn as Mermaid state diagrams.


class Arrow(NamedTuple):
    name: str
    target: str


def test_the_diagram_names_every_jump_with_one_arrow_for_each_pair_of_modes():
    table = {"off": (Arrow("too_cold", "on"),), "on": (Arrow("warm_enough", "off"), Arrow("broken", "off"))}
    assert mermaid(table, str.upper).splitlines() == [
        "stateDiagram-v2",
        "    OFF --> ON: too_cold",
        "    ON --> OFF: warm_enough, broken",
    ]


def test_a_jump_that_most_modes_have_is_drawn_once():
    fall = Arrow("break", "broken")
    table = {"off": (fall, Arrow("start", "on")), "on": (fall,), "idle": (fall,), "broken": ()}
    assert mermaid(table).splitlines() == [
        "stateDiagram-v2",
        '    state "all but broken" as most1',
        "    most1 --> broken: break",
        "    off --> on: start",
    ]
