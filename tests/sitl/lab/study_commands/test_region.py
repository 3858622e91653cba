"""``darko-sitl study region``: its tables, and refused arguments."""

from sitl.__main__ import main
from sitl.lab.studies.hover_region import _lines
from tests.support.lab.region_results import made_up_results


def test_the_tables_show_proved_levels_and_advised_thresholds():
    text = "\n".join(_lines(made_up_results()))
    assert "0.0200   0.0470     0.0600   0.1000    0.860   0.11 m" in text
    assert "1.00 (1.00)" in text
    assert " ".join(text.splitlines()[-1].split()) == "LQR 99 99 50/99 100.0%/100.0% sound 0.0%/0.0% too high"


def test_bad_arguments_are_a_one_line_error(capsys):
    assert main(["study", "region", "--samples", "2"]) == 2
    assert "at least 6" in capsys.readouterr().err
    assert main(["study", "region", "--airframe", "nothing"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
