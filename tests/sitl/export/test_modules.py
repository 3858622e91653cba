"""The modules of Paparazzi and PX4: they compile against the autopilots' public interfaces, and frames are right."""

import math
import shutil
import subprocess
from pathlib import Path

import pytest
from defusedxml.ElementTree import fromstring

from protocol.dialect.vocabulary import Law
from sitl.export.autopilots import module_files
from sitl.export.build import STRICT
from tests.support.exported import C_SOURCES, files, need, write

HALF = math.sqrt(0.5)
UPRIGHT = (HALF, 0.0, HALF, 0.0)  # x out of the nose, which is up: NED and FRD
PX4_HEADERS = (
    "px4_platform_common/module.h",
    "px4_platform_common/px4_work_queue/ScheduledWorkItem.hpp",
    "uORB/Publication.hpp",
    "uORB/Subscription.hpp",
    "uORB/topics/actuator_armed.h",
    "uORB/topics/actuator_motors.h",
    "uORB/topics/actuator_servos.h",
    "uORB/topics/trajectory_setpoint.h",
    "uORB/topics/vehicle_land_detected.h",
    "uORB/topics/vehicle_local_position.h",
    "uORB/topics/vehicle_odometry.h",
    "drivers/drv_hrt.h",
)
WARNINGS = ("-Wall", "-Wextra", "-Werror", "-Wshadow", "-Wconversion", "-Wdouble-promotion")


def run(command, place):
    ran = subprocess.run([str(word) for word in command], cwd=place, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


@pytest.fixture(scope="module")
def paparazzi(tmp_path_factory):
    """A program that flies the module over stand-ins for the state interface."""
    need("gcc")
    place = tmp_path_factory.mktemp("airborne")
    shutil.copytree(C_SOURCES / "paparazzi", place, dirs_exist_ok=True)
    module = place / "modules" / "ctrl_darko"
    write(module, files(single=True).files | module_files("paparazzi"))
    made = {}
    for frame in ("FALSE", "TRUE"):
        program = place / f"flown_{frame}"
        frames = f"-DCTRL_DARKO_HOVERS_LEVEL={frame}"
        sources = [module / "ctrl_darko.c", module / "darko_controller.c", place / "flown.c"]
        run(
            ["gcc", *STRICT, *WARNINGS, "-O1", frames, "-I", place, "-I", module, "-o", program, *sources, "-lm"], place
        )
        made[frame] = program
    return made


def flown(program, attitude=UPRIGHT, pitch_rate=0.0, flies=1):
    words = run([program, *(repr(float(x)) for x in (*attitude, pitch_rate)), flies], program.parent).split()
    return [int(word) for word in words[:4]], int(words[5]), int(words[7]), int(words[9])


@pytest.mark.long
def test_paparazzi_hovers_with_both_motors_alike_and_in_range(paparazzi):
    (left, right, motor_right, motor_left), law, status, thrust = flown(paparazzi["FALSE"])
    assert (law, status) == (Law.HOVER_LINEAR, 0) or law == Law.INDI
    assert abs(left) < 9600
    assert abs(right) < 9600
    assert 3000 < motor_right < 9600
    assert abs(motor_left - motor_right) < 30
    assert abs(thrust - (motor_left + motor_right) / 2) <= 1


@pytest.mark.long
def test_a_nose_that_rises_is_brought_down_by_both_trailing_edges(paparazzi):
    still, _, _, _ = flown(paparazzi["FALSE"])
    rising, _, _, _ = flown(paparazzi["FALSE"], pitch_rate=0.5)
    assert rising[0] > still[0]  # down: positive on the left
    assert rising[1] < still[1]  # and negative on the right, whose servo is inverted


@pytest.mark.long
def test_the_two_bodies_of_a_tail_sitter_are_one(paparazzi):
    by_nose = flown(paparazzi["FALSE"], pitch_rate=0.2)
    level = flown(paparazzi["TRUE"], attitude=(1.0, 0.0, 0.0, 0.0), pitch_rate=0.2)
    assert max(abs(a - b) for a, b in zip(by_nose[0], level[0], strict=True)) <= 2


@pytest.mark.long
def test_on_the_ground_it_stands_and_takes_off_where_it_is_asked_to(paparazzi):
    _, law, status, thrust = flown(paparazzi["FALSE"], flies=0)
    assert law in {Law.LANDED, Law.INDI}
    assert status == 0
    assert thrust == 1000


@pytest.mark.long
def test_the_xml_of_paparazzi_names_what_there_is():
    texts = module_files("paparazzi")
    module = fromstring(texts["conf/modules/ctrl_darko.xml"])
    order = [child.tag for child in module]
    assert order == ["doc", "settings", "dep", "header", "init", "makefile"]  # as module.dtd wants it
    sources = {node.get("name") for node in module.find("makefile").findall("file")}
    assert sources <= texts.keys() | files(single=True).files.keys()
    functions = [module.find("init").get("fun")]
    autopilot = fromstring(texts["conf/autopilot/darko.xml"])
    functions += [node.get("fun") for node in autopilot.iter("call") if "ctrl_darko" in node.get("fun")]
    for function in functions:
        assert f"{function.split('(')[0]}(" in texts["ctrl_darko.h"]
    modes = [node for node in autopilot.iter("mode") if "$DEFAULT_MODE" in {one.get("cond") for one in node}]
    assert [mode.get("name") for mode in modes] == ["KILL"]  # as in Paparazzi's own autopilots: it boots dead
    airframe = fromstring(texts["conf/airframes/darko_section.xml"])
    defined = {node.get("name") for node in airframe.find("section").findall("define")}
    assert defined == {node.get("name") for node in module.find("doc").find("section").findall("define")}
    assert all(f"CTRL_DARKO_{name}" in texts["ctrl_darko.c"] for name in defined)


@pytest.mark.long
def test_px4_compiles_against_its_interface(tmp_path):
    need("g++")
    write(tmp_path, files(single=True).files | module_files("px4"))
    stubs = (C_SOURCES / "px4" / "px4_stubs.hpp").read_text(encoding="utf-8")
    write(tmp_path, dict.fromkeys(PX4_HEADERS, '#pragma once\n#include "px4_stubs.hpp"\n') | {"px4_stubs.hpp": stubs})
    warnings = [word for word in WARNINGS if word != "-Wshadow"]
    options = ["-std=c++14", "-fno-exceptions", *warnings, "-Wno-unused-parameter", "-I", tmp_path, "-fsyntax-only"]
    run(["g++", *options, "DarkoControl.cpp"], tmp_path)
    named = Path(tmp_path / "CMakeLists.txt").read_text(encoding="utf-8").split()
    assert {word for word in named if word.endswith((".cpp", ".hpp", ".c"))} <= {
        path.name for path in tmp_path.iterdir()
    }
