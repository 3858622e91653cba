"""The exported code on the processors of autopilots, emulated: the same bits."""

import subprocess

import pytest

from sitl.export.build import STRICT, WARNINGS
from sitl.export.random_flights import random_flight
from sitl.export.random_navigation import random_navigation
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.avionics import Navigation
from tests.support.exported import AIRFRAME, estimator_program, need, program

SECONDS = 0.1
NAVIGATED = 0.4  # longer than the filter stands in the past [s]
M7 = ("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard")
# Vectors at 0, code behind them, data in RAM; input and output by semihosting.
BARE = ("--specs=rdimon.specs", "-Wl,--section-start=.vectors=0x0", "-Wl,-Tdata=0x20000000")


def run(command, place):
    ran = subprocess.run(command, cwd=place, capture_output=True, text=True, timeout=300)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


@pytest.mark.long
def test_a_cortex_m7_flies_the_same_bits(tmp_path):
    need("arm-none-eabi-gcc")
    need("qemu-system-arm")
    sources = program(tmp_path, random_flight(3, SECONDS, (AIRFRAME,)))
    count = "-DCOUNT_TICKS=instructions"
    compiler = ["arm-none-eabi-gcc", *STRICT, *M7, *BARE, "-O2", "-fno-math-errno", count, "-o", "m7.elf"]
    run([*compiler, *sources, "cortex_m7.c", "-lm"], tmp_path)
    board = ["qemu-system-arm", "-M", "mps2-an500", "-nographic", "-semihosting", "-icount", "shift=0"]
    told = run([*board, "-kernel", "m7.elf"], tmp_path)
    assert "50 periods: 0 numbers differ, 0 steps" in told
    print(told)
    assert "instructions of a step" in told


@pytest.mark.long
@pytest.mark.parametrize("level", ["-O0", "-O2"])
def test_an_aarch64_flies_the_same_bits(tmp_path, level):
    need("aarch64-linux-gnu-gcc")
    need("qemu-aarch64")
    sources = program(tmp_path, random_flight(3, SECONDS, (AIRFRAME,)))
    run(["aarch64-linux-gnu-gcc", *STRICT, *WARNINGS, level, "-static", "-o", "flown", *sources, "-lm"], tmp_path)
    assert run(["qemu-aarch64", "./flown"], tmp_path).startswith("50 periods: 0 numbers differ, 0 steps")


def navigation(place):
    """Sources that navigate a flight of chance once more."""
    return estimator_program(place, random_navigation(3, NAVIGATED, AIRFRAME, load_sensors(), Navigation.SENSORS))


@pytest.mark.long
def test_a_cortex_m7_navigates_to_the_same_bits(tmp_path):
    need("arm-none-eabi-gcc")
    need("qemu-system-arm")
    sources = [*navigation(tmp_path), "cortex_m7.c"]
    count = "-DCOUNT_TICKS=instructions"
    compiler = ["arm-none-eabi-gcc", *STRICT, *M7, *BARE, "-O2", "-fno-math-errno", count, "-o", "m7.elf"]
    run([*compiler, *sources, "-lm"], tmp_path)
    board = ["qemu-system-arm", "-M", "mps2-an500", "-nographic", "-semihosting", "-icount", "shift=0"]
    told = run([*board, "-kernel", "m7.elf"], tmp_path)
    assert "200 periods: 0 numbers differ" in told
    assert "instructions of a period" in told


@pytest.mark.long
@pytest.mark.parametrize("level", ["-O0", "-O2"])
def test_an_aarch64_navigates_to_the_same_bits(tmp_path, level):
    need("aarch64-linux-gnu-gcc")
    need("qemu-aarch64")
    sources = navigation(tmp_path)
    run(["aarch64-linux-gnu-gcc", *STRICT, *WARNINGS, level, "-static", "-o", "flown", *sources, "-lm"], tmp_path)
    assert run(["qemu-aarch64", "./flown"], tmp_path).startswith("200 periods: 0 numbers differ")
