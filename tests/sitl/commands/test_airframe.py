"""``darko-sitl airframe``: tables and plots of trims."""

import pytest

from sitl.commands import airframe
from sitl.errors import SitlError


def run(*arguments):
    return airframe.run(airframe.parser({"airframe": ""}).parse_args(arguments))


def test_the_table_marks_speeds_without_a_trim(capsys):
    run("nominal", "--trims", "--climb", "-15")
    lines = capsys.readouterr().out.splitlines()
    assert [int(line.split()[0]) for line in lines[1:] if "no trim" in line] == [5, 6, 7, *range(13, 26)]


def test_the_table_of_a_turn_has_both_elevons(capsys):
    run("nominal", "--trims", "--turn", "30")
    row = capsys.readouterr().out.splitlines()[6].split()
    assert row[:2] == ["5", "30.0"]
    assert float(row[4]) < float(row[5])
    run("nominal", "--trims", "--bank", "30")
    assert float(capsys.readouterr().out.splitlines()[1].split()[2]) == 30.0


@pytest.mark.long
def test_the_plot_is_written_or_an_error_names_its_path(tmp_path, capsys):
    run("published", "--trims", "--plot", str(tmp_path / "trims.png"))
    assert (tmp_path / "trims.png").stat().st_size > 50_000
    with pytest.raises(SitlError, match=r"plot .*nosuch"):
        run("published", "--trims", "--plot", str(tmp_path / "nosuch" / "trims.png"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nominal", "--trims", "--climb", "90"), "--climb 90 is not within"),
        (("nominal", "--trims", "--bank", "91"), "--bank 91 is not within"),
        (("nominal", "--turn", "10"), "--turn needs a parameter set"),
        (("--trims", "--climb", "10"), "--climb needs a parameter set"),
    ],
)
def test_angles_out_of_range_and_options_without_trims_are_refused(arguments, words):
    with pytest.raises(SitlError, match=words):
        run(*arguments)
