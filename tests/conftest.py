"""The test run: examples of property tests, which process takes what, nothing in the user's own folders.

Property tests draw no new examples unless HYPOTHESIS_PROFILE=explore asks for them.
"""

import gc
import os
from collections import Counter

import pytest
from hypothesis import Phase, settings

from sitl.tools.error_guard import ErrorGuard
from tests.support.processor_time import ProcessorTime

# To explain a failure, hypothesis traces every example, also where all pass: a tenth of the time; `explore` explains.
UNTRACED = tuple(phase for phase in Phase if phase is not Phase.explain)
settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=50, phases=UNTRACED)
settings.register_profile("explore", deadline=None, print_blob=True)
PROFILE = os.environ.get("HYPOTHESIS_PROFILE", "repeatable")
settings.load_profile(PROFILE)

# What `--quick` leaves out: what compiles anew, starts processes, flies for minutes or drives whole screens.
SLOW = (
    "darko_gcs/motion_capture/test_pose_bridge.py",
    "darko_gcs/station/test_flight_plan.py",
    "darko_gcs/station/test_flood.py",
    "darko_gcs/station/test_plan_requests.py",
    "darko_gcs/station/test_restarts.py",
    "darko_gcs/station/test_station.py",
    "darko_gcs/tui/",
    "e2e/",
    "protocol/both_ends/",
    "scripts/",
    "sitl/autopilot/flight_plan/test_plan_flights.py",
    "sitl/autopilot/mission/",
    "sitl/autopilot/test_path_watch.py",
    "sitl/autopilot/test_failsafes.py",
    "sitl/autopilot/test_failsafe_flights.py",
    "sitl/autopilot/test_fence.py",
    "sitl/autopilot/test_watches.py",
    "sitl/autopilot/test_navigation_flights.py",
    "sitl/autopilot/test_flight_plans.py",
    "sitl/autopilot/test_manual.py",
    "sitl/autopilot/test_leg_planner.py",
    "sitl/autopilot/test_guided.py",
    "sitl/commands/",
    "sitl/control/forward_flight/test_line_of_sight.py",
    "sitl/control/test_hover_attitude.py",
    "sitl/control/test_wind_estimator.py",
    "sitl/control/test_zero_moment.py",
    "sitl/day/test_day.py",
    "sitl/design/test_lmi.py",
    "sitl/lab/proofs/test_proved.py",
    "sitl/lab/proofs/test_region.py",
    "sitl/design/test_processors.py",
    "sitl/enclosure/test_turbulence.py",
    "sitl/export/",
    "sitl/flights/",
    "sitl/mavlink/services/test_command_service.py",
    "sitl/mavlink/services/test_peer_inputs.py",
    "sitl/mavlink/test_flight_recorder_disk.py",
    "sitl/mavlink/test_flood.py",
    "sitl/mavlink/test_ground_control_buttons.py",
    "sitl/mavlink/test_home.py",
    "sitl/mavlink/telemetry/test_telemetry_service.py",
    "sitl/mavlink/test_node.py",
    "sitl/mavlink/services/test_offboard_setpoints.py",
    "sitl/mavlink/test_wire_page.py",
    "sitl/model/test_ground.py",
    "sitl/motion_capture/test_flying_on_the_stream.py",
    "sitl/lab/reproduction/",
    "sitl/lab/test_live_scenario.py",
    "sitl/lab/test_scenarios.py",
    "sitl/simulation/test_accuracy.py",
    "sitl/simulation/test_batch.py",
    "sitl/simulation/test_dispatch.py",
    "sitl/simulation/test_loop_matches_python.py",
    "sitl/simulation/test_same_everywhere.py",
    "sitl/simulation/test_sensed_same_everywhere.py",
    "sitl/lab/studies/",
    "test_adding.py",
    "sitl/supervisor/test_table.py",
    "sitl/lab/identification/test_identification_study.py",
    "sitl/lab/identification/test_identify_flight.py",
    "sitl/lab/identification/test_output_error.py",
    "sitl/vehicle/test_actuator_watch.py",
    "sitl/tools/test_kernel_cache.py",
    "sitl/tools/test_persistence.py",
    "sitl/test_storage.py",
    "sitl/process/test_warm_up.py",
    "test_api_page.py",
)

# Long work comes first: at the end it would leave the other processes idle.
LONGEST = (
    "sitl/simulation/",
    "sitl/design/test_processors.py",
    "sitl/lab/proofs/test_proved.py",
    "sitl/lab/identification/",
    "sitl/lab/test_live_scenario.py",
    "sitl/lab/test_scenarios.py",
    "sitl/lab/studies/",
    "sitl/test_storage.py",
    "test_api_page.py",
)
# What waits half of its time, for other processes or for a screen, goes in turn with what computes.
WAITING = ("darko_gcs/tui/", "e2e/")

# What platformdirs asks for the user's folders. The cache stays: kernels are kept there, and what else only saves time.
USER_FOLDERS = ("XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME", "XDG_PICTURES_DIR")

# Folders whose files share what is dear: one process takes all of them.
TOGETHER = ("sitl/simulation/", "sitl/lab/identification/")


def pytest_addoption(parser):
    parser.addoption("--quick", action="store_true", help="leave out more: what compiles, starts processes, flies")
    parser.addoption("--all", action="store_true", help="also the tests marked long, which CI runs")
    parser.addoption("--processor-time", action="store_true", help="list the processor's seconds by file and by test")


def pytest_configure(config):
    config.addinivalue_line(
        "markers",
        "long(after=0): takes seconds of a processor, all but its first cases, so many; run by --all, or where its file"
        " is named",
    )
    ErrorGuard.raises = True  # an error that a vehicle would report, and fly on, fails the test
    if config.getoption("--processor-time"):
        config.pluginmanager.register(ProcessorTime())


def pytest_ignore_collect(collection_path, config):
    if not config.getoption("--quick") or collection_path.is_dir():
        return None
    path = collection_path.relative_to(config.rootpath / "tests").as_posix()
    return True if path.startswith(SLOW) else None


def leaves_out_long(config):
    """Whether the run is of everything, but for what takes long: a file that is named is run whole."""
    return not config.getoption("--all") and not config.getoption("file_or_dir")


def long_ones(items):
    """The items that are marked long, but for the first cases of a test that are always run."""
    met = Counter()
    for item in items:
        marker = item.get_closest_marker("long")
        if marker is not None:
            test = item.nodeid.partition("[")[0]
            met[test] += 1
            if met[test] > marker.kwargs.get("after", 0):
                yield item


def share(path):
    """Name of what one process takes as a whole: a folder of ``TOGETHER``, or a file."""
    return next((folder for folder in TOGETHER if path.startswith(folder)), path)


def in_turn(paths):
    """The order in which processes take what they share: the longest first, then waiting and computing in turn."""
    first = [path for long in LONGEST for path in paths if path.startswith(long)]
    rest = [path for path in paths if not path.startswith(LONGEST)]
    waiting = [path for path in rest if path.startswith(WAITING)]
    computing = [path for path in rest if not path.startswith(WAITING)]
    every = max(len(computing), 1) / max(len(waiting), 1)
    keyed = [(i * every, path) for i, path in enumerate(waiting)] + list(enumerate(computing))
    return [*first, *(path for _, path in sorted(keyed, key=lambda pair: pair[0]))]


@pytest.hookimpl(tryfirst=True)  # xdist reads the groups in its own
def pytest_collection_modifyitems(config, items):
    if leaves_out_long(config):
        left_out = list(long_ones(items))
        config.hook.pytest_deselected(items=left_out)
        gone = {id(item) for item in left_out}
        items[:] = [item for item in items if id(item) not in gone]
    paths = [share(item.nodeid.removeprefix("tests/").partition("::")[0]) for item in items]
    place = {path: i for i, path in enumerate(in_turn(list(dict.fromkeys(paths))))}
    of_item = dict(zip(items, paths, strict=True))
    items.sort(key=lambda item: place[of_item[item]])
    if config.pluginmanager.hasplugin("xdist"):  # mutants are tested without
        for item in items:
            item.add_marker(pytest.mark.xdist_group(of_item[item]))


@pytest.fixture(scope="session", autouse=True)
def folders_of_nobody(tmp_path_factory):
    """Programs under test, and those that they start, read and write nothing in the folders of who runs the tests."""
    folder = tmp_path_factory.mktemp("user")
    with pytest.MonkeyPatch.context() as patch:
        for name in USER_FOLDERS:
            patch.setenv(name, str(folder / name.split("_")[1].lower()))
        yield


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


def pytest_collection_finish():
    """Freeze the collected tests: garbage collection through them, as often as usual, takes a tenth of the time."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)
