"""The exported files under the strictest compilers and checkers, and what they need of a library and of the stack."""

import subprocess

import pytest

from sitl.export.build import STRICT, WARNINGS
from sitl.export.builds import NAVIGATE
from sitl.export.random_flights import random_flight
from sitl.export.random_navigation import random_navigation
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.avionics import Navigation
from tests.support.exported import AIRFRAME, estimator_folder, folder, need, program

ALLOWED = {"sqrt", "memcpy", "memset"}  # the last two are how compilers copy structs
SOURCES = ("darko_controller.c", "darko_estimator.c")


def run(command, place):
    ran = subprocess.run([str(word) for word in command], cwd=place, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout + ran.stderr


@pytest.mark.long
@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("cc", ["gcc", "clang"])
@pytest.mark.parametrize("name", SOURCES)
def test_no_warning_and_no_library_but_the_square_root(tmp_path, name, cc, single):
    need(cc)
    made, source = tmp_path / "made.o", estimator_folder(single=single) / name
    run([cc, *STRICT, *WARNINGS, "-O0", "-c", source, "-o", made], tmp_path)
    needed = {line.split()[-1].removesuffix("f") for line in run(["nm", "-u", made], tmp_path).splitlines()}
    assert needed <= ALLOWED
    kept = [line.split()[1] for line in run(["nm", "--defined-only", made], tmp_path).splitlines()]
    assert set(kept) <= {"T", "t", "R", "r"}  # code and constants: nothing that is written


@pytest.mark.long
def test_nothing_undefined_happens_in_a_flight(tmp_path):
    need("gcc")
    sources = program(tmp_path, random_flight(1, 0.2, (AIRFRAME,)))
    checks = ["-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all", "-O1"]
    run(["gcc", *STRICT, *WARNINGS, *checks, "-o", "flown", *sources, "-lm"], tmp_path)
    assert "0 numbers differ, 0 steps" in run(["./flown"], tmp_path)


@pytest.mark.long
def test_nothing_undefined_happens_in_the_estimator(tmp_path):
    need("gcc")
    flight = random_navigation(0, 0.5, AIRFRAME, load_sensors(), Navigation.SENSORS)
    sources = program(tmp_path, flight, NAVIGATE)
    checks = ["-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all", "-O1"]
    run(["gcc", *STRICT, *WARNINGS, *checks, "-o", "navigated", *sources, "-lm"], tmp_path)
    assert "250 periods: 0 numbers differ" in run(["./navigated"], tmp_path)


@pytest.mark.long
def test_cppcheck_has_nothing_to_say():
    need("cppcheck")
    checks = ["--std=c99", "--enable=warning,performance,portability", "--error-exitcode=1", "-q"]
    assert run(["cppcheck", *checks, *SOURCES], estimator_folder()) == ""


@pytest.mark.long
def test_a_build_that_would_reorder_sums_is_refused():
    need("gcc")
    with pytest.raises(AssertionError, match="must be compiled without -ffast-math"):
        run(["gcc", "-std=c99", "-ffast-math", "-fsyntax-only", "darko_controller.c"], folder())
