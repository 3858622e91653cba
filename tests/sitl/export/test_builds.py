"""The exported files under the strictest compilers and checkers, and what they need of a library and of the stack."""

import subprocess

import pytest

from sitl.export.build import STRICT, WARNINGS
from sitl.export.random_flights import random_flight
from tests.support.exported import AIRFRAME, folder, need, program

ALLOWED = {"sqrt", "memcpy", "memset"}  # the last two are how compilers copy structs


def run(command, place):
    ran = subprocess.run([str(word) for word in command], cwd=place, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout + ran.stderr


@pytest.mark.long
@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("cc", ["gcc", "clang"])
def test_no_warning_and_no_library_but_the_square_root(tmp_path, cc, single):
    need(cc)
    made = tmp_path / "controller.o"
    run([cc, *STRICT, *WARNINGS, "-O0", "-c", folder(single) / "darko_controller.c", "-o", made], tmp_path)
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
def test_cppcheck_has_nothing_to_say():
    need("cppcheck")
    checks = ["--std=c99", "--enable=warning,performance,portability", "--error-exitcode=1", "-q"]
    assert run(["cppcheck", *checks, "darko_controller.c"], folder()) == ""


def test_a_build_that_would_reorder_sums_is_refused():
    need("gcc")
    with pytest.raises(AssertionError, match="must be compiled without -ffast-math"):
        run(["gcc", "-std=c99", "-ffast-math", "-fsyntax-only", "darko_controller.c"], folder())
