"""The operator's requests to the vehicle by key, and the questions before those that need one."""

import pytest
from textual.widgets import Input

from darko_gcs.state.fence_edits import STAY_IN, new_area
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.state.speed_in_force import is_for_later_legs, speed_problem
from darko_gcs.state.values import SpeedOrder
from darko_gcs.tui.actions import disarm_question, start_question
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.screens.dialogs import AskScreen, ConfirmScreen
from darko_gcs.tui.screens.flight_screen import FlightScreen
from protocol.dialect import mavlink
from protocol.events import CommandProgress
from sitl.defaults import HOME
from tests.support.gcs.screens import FakeFeed, confirm, notices, screen_text, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.vehicle.mission_items import waypoint

IN_AIR, ON_GROUND = mavlink.MAV_LANDED_STATE_IN_AIR, mavlink.MAV_LANDED_STATE_ON_GROUND
TO_FORWARD, TO_HOVER = mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW, mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC
IN_HOVER, IN_FORWARD = mavlink.MAV_VTOL_STATE_MC, mavlink.MAV_VTOL_STATE_FW


@pytest.fixture
def feed():
    return FakeFeed(HOVERING)


async def test_arming_is_confirmed_first(feed):
    feed.snapshot = snapshot_with(HOVERING, status={"armed": False, "landed_state": ON_GROUND})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("a")
        assert isinstance(app.screen, ConfirmScreen)
        await pilot.press("n")
        assert feed.requests == []
        await confirm(pilot, "a")
        assert feed.requests == [("arm",)]
    assert feed.closed


async def test_disarming_in_flight_is_confirmed_and_then_forced(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("d")
        assert isinstance(app.screen, ConfirmScreen)
        await pilot.press("enter")  # "no" has the focus
        assert feed.requests == []
        await pilot.press("d")
        await until(pilot, lambda: "Yes (D)" in screen_text(app))
        await pilot.press("y")  # it also begins flight by hand, where d turns
        assert feed.requests == []
        await pilot.press("D")
        await until(pilot, lambda: feed.requests == [("disarm", ("force", True))])


async def test_a_yes_to_the_ground_never_drops_a_vehicle_that_has_taken_off_meanwhile(feed):
    feed.snapshot = feed.station.snapshot = snapshot_with(HOVERING, status={"landed_state": ON_GROUND})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("d")
        await until(pilot, lambda: "The propellers will stop" in screen_text(app))
        feed.snapshot = feed.station.snapshot = HOVERING
        await pilot.press("y")
        await until(pilot, lambda: feed.requests == [("disarm", ("force", False))])


async def test_disarming_on_the_ground_is_not_forced(feed):
    feed.snapshot = feed.station.snapshot = snapshot_with(HOVERING, status={"landed_state": ON_GROUND})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("d")
        await until(pilot, lambda: "The propellers will stop" in screen_text(app))
        await pilot.press("y")
        await until(pilot, lambda: feed.requests == [("disarm", ("force", False))])


async def test_take_off_asks_for_a_height_and_accepts_only_a_number(feed):
    feed.snapshot = snapshot_with(HOVERING, status={"landed_state": ON_GROUND})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("t")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("x", "enter")
        await until(pilot, lambda: "is not a number" in screen_text(app))
        await pilot.press("backspace", "backspace", "5", "enter")
        await until(pilot, lambda: feed.requests == [("take_off", 5.0, ("arm", False))])


async def test_a_disarmed_vehicle_is_armed_for_take_off_as_the_form_says(feed):
    feed.snapshot = snapshot_with(HOVERING, status={"landed_state": ON_GROUND, "armed": False})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("t")
        await until(pilot, lambda: isinstance(app.focused, Input) and "Arm and take off" in screen_text(app))
        await pilot.press("enter")
        await until(pilot, lambda: feed.requests == [("take_off", 6.0, ("arm", True))])


async def test_go_to_asks_for_metres_from_home(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("g")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: feed.requests == [("go_to", 2.0, 1.0, 3.0)])


async def test_go_to_asks_for_metres_from_the_moved_home(feed):
    feed.snapshot = snapshot_with(HOVERING, position={"told_home_p": (1.0, -1.0, -1.0)})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("g")
        await pilot.press("enter")
        await until(pilot, lambda: feed.requests == [("go_to", 1.0, 2.0, 2.0)])


async def test_without_a_simulator_of_its_own_the_key_reboots_the_vehicle_after_a_yes(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("ctrl+r")
        await until(pilot, lambda: isinstance(app.screen, ConfirmScreen) and "Reboot the vehicle?" in screen_text(app))
        await pilot.press("n")
        assert feed.requests == []
        await confirm(pilot, "ctrl+r")
        await until(pilot, lambda: feed.requests == [("reboot",)])


@pytest.mark.long
async def test_moving_home_is_confirmed_with_the_height(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("H")
        await until(pilot, lambda: isinstance(app.screen, ConfirmScreen) and "3.0 m above the" in screen_text(app))
        await pilot.press("n")
        assert feed.requests == []
        await confirm(pilot, "H")
        await until(pilot, lambda: feed.requests == [("set_home",)])


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("height", "is_told"), [(2.1, True), (2.98, False), (10.0, False)])
async def test_the_question_tells_the_height_that_a_front_transition_needs_where_the_vehicle_is_too_low(
    feed, height, is_told
):
    feed.snapshot = snapshot_with(HOVERING, status={"vtol_state": IN_HOVER}, position={"p": (0.0, 0.0, -height)})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("v")
        await until(pilot, lambda: "forward flight?" in screen_text(app))
        assert ("It needs 3 m of height; the" in screen_text(app)) == is_told


@pytest.mark.long
async def test_a_transition_goes_in_the_direction_that_was_confirmed(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        for vtol, words, forward in (
            (TO_HOVER, "to forward flight?", True),
            (TO_FORWARD, "back to hover?", False),
        ):
            feed.snapshot = snapshot_with(HOVERING, status={"vtol_state": vtol})
            await pilot.press("v")
            asked = (words, "A mission is being flown")
            await until(pilot, lambda asked=asked: all(part in screen_text(app) for part in asked))
            await pilot.press("n", "v")
            assert feed.requests == []
            feed.snapshot = snapshot_with(
                HOVERING, status={"vtol_state": IN_FORWARD if forward else IN_HOVER}
            )  # it changes meanwhile
            await pilot.press("y")
            await until(pilot, lambda sent=("transition", ("forward", forward)): feed.requests == [sent])
            feed.requests.clear()


CONTROL = (  # who has it, who asks for it, what the key asks, what is sent
    (0, 0, "Take control as ground station 255?", "take_control"),
    (245, 0, "Ask ground station 245", "take_control"),
    (255, 0, "Give control back?", "give_control_back"),
    (255, 245, "Let ground station 245", "share_control"),
)


@pytest.mark.long
async def test_control_is_taken_requested_shared_or_given_back(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        for holder, asked_by, words, request_name in CONTROL:
            feed.snapshot = snapshot_with(HOVERING, operator={"in_control": holder, "control_asked_by": asked_by})
            await pilot.press("k")
            await until(pilot, lambda words=words: words in screen_text(app))
            await pilot.press("n")
            assert feed.requests == []
            await confirm(pilot, "k")
            await until(pilot, lambda sent=(request_name,): feed.requests == [sent])
            feed.requests.clear()


async def test_a_speed_is_asked_for_with_its_kind(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("c")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: "Speed [m/s]: '' is not a number" in screen_text(app))
        await pilot.press("1", "5", "tab", "2", "enter")
        await until(pilot, lambda: "ground for a ground speed" in screen_text(app))
        await pilot.press("backspace", "g", "enter")
        await until(pilot, lambda: feed.requests == [("change_speed", 15.0, ("over_ground", True))])


async def test_the_form_of_a_speed_tells_what_is_flown_and_refuses_what_lies_between(feed):
    feed.snapshot = snapshot_with(HOVERING, parameters={"values": {"DRK_HOV_VMAX": 3.0, "DRK_FWD_SPEED": 15.0}})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("c")
        words = "0.1 to 3 in the hover, 7 to 22 forward; now 3 and 15"
        await until(pilot, lambda: isinstance(app.focused, Input) and words in screen_text(app))
        app.focused.value = "5"
        await pilot.press("enter")
        await until(pilot, lambda: "5 m/s is too fast for the hover and too slow for" in screen_text(app))
        assert feed.requests == []
        app.focused.value = "3"
        await pilot.press("enter")
        await until(pilot, lambda: len(feed.requests) == 1)


HOVERS, FLIES = {"vtol_state": mavlink.MAV_VTOL_STATE_MC}, {"vtol_state": mavlink.MAV_VTOL_STATE_FW}
SPEEDS = {"values": {"DRK_HOV_VMAX": 3.0, "DRK_FWD_SPEED": 15.0}}
NO_MISSION = {"state": mavlink.MISSION_STATE_NOT_STARTED}


async def test_a_forward_speed_that_is_asked_for_in_the_hover_is_that_of_the_legs_to_come(feed):
    feed.snapshot = snapshot_with(HOVERING, parameters=SPEEDS, status=HOVERS, mission=NO_MISSION)
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("c")
        await until(pilot, lambda: "7 to 22 forward, from the next leg on" in screen_text(app))
        app.focused.value = "12"
        await pilot.press("tab", "g", "r", "o", "u", "n", "d", "enter")
        await until(pilot, lambda: "only the airspeed can be chosen" in screen_text(app))
        app.focused.value = "air"
        await pilot.press("enter")
        await until(pilot, lambda: feed.requests == [("set_parameter", "DRK_FWD_SPEED", 12.0)])


async def test_in_forward_flight_no_speed_of_the_hover_is_offered(feed):
    feed.snapshot = snapshot_with(HOVERING, parameters=SPEEDS, status=FLIES, mission=NO_MISSION)
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("c")
        await until(pilot, lambda: "7 to 22, as it flies forward" in screen_text(app))
        app.focused.value = "2"
        await pilot.press("enter")
        await until(pilot, lambda: "2 m/s is a speed of the hover, and it flies forward" in screen_text(app))
        assert feed.requests == []


@pytest.mark.parametrize("state", [HOVERS, FLIES])
def test_a_mission_takes_both_speeds_at_any_time(state):
    s = snapshot_with(HOVERING, parameters=SPEEDS, status=state, mission={"state": mavlink.MISSION_STATE_ACTIVE})
    assert [speed_problem(s, speed, over_ground=True) for speed in (2.0, 12.0)] == ["", ""]
    assert not is_for_later_legs(s, 12.0)


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "flown forward where that needs less energy; the speed of c is for the hover"),
        ({"DRK_WAY": 1.0}, "It hovers all the way (DRK_WAY)"),
        ({"DRK_WAY": 2.0}, "It is flown forward where that is possible (DRK_WAY)"),
    ],
)
async def test_the_form_of_a_goto_tells_how_it_is_flown(feed, values, words):
    feed.snapshot = snapshot_with(HOVERING, parameters={"values": values})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("g")
        await until(pilot, lambda: isinstance(app.screen, AskScreen))
        assert words in app.screen._title


@pytest.mark.long(after=2)
async def test_what_moves_or_stops_the_vehicle_asks_first(feed):
    transition = CommandProgress(request=1, command=mavlink.MAV_CMD_DO_VTOL_TRANSITION, progress=50)
    feed.snapshot = snapshot_with(
        HOVERING, operator={"in_progress": transition}, mission={"state": mavlink.MISSION_STATE_PAUSED}
    )
    requests = {"h": ("hold",), "l": ("land",), "r": ("return_home",), "x": ("cancel",)}
    requests["s"] = ("plans.start_mission", ("arm", False))
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        for key, request in requests.items():
            await pilot.press(key)
            await until(pilot, lambda: isinstance(app.screen, ConfirmScreen))
            assert "mission that is being flown" not in screen_text(app)
            await pilot.press("escape", key)
            assert feed.requests == []
            await pilot.press("y")
            await until(pilot, lambda sent=request: feed.requests == [sent])
            feed.requests.clear()


async def test_the_question_says_that_a_mission_is_left(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("h")
        await until(pilot, lambda: "This interrupts the mission" in screen_text(app))


async def test_a_request_without_sense_is_not_even_asked(feed):
    feed.snapshot = snapshot_with(HOVERING, status={"landed_state": ON_GROUND})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await pilot.press("v")
        await until(pilot, lambda: "The vehicle is on the" in screen_text(app))
        assert isinstance(app.screen, FlightScreen)


async def test_without_a_vehicle_nothing_is_sent(feed):
    feed.snapshot = EMPTY_SNAPSHOT
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "waiting for a vehicle" in screen_text(app))
        await pilot.press("a", "t", "h", "l", "s")
        assert feed.requests == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mission": {"total": 0}, "plans": {"mission": ()}}, "The vehicle has no mission: nothing was sent"),
        ({}, "does not have the plan that you edited"),
    ],
)
async def test_a_mission_that_the_vehicle_does_not_have_is_not_flown_from_the_flight_screen(feed, changes, words):
    waiting = snapshot_with(HOVERING, mission={"state": mavlink.MISSION_STATE_NOT_STARTED, "current": 0})
    feed.snapshot = snapshot_with(waiting, **changes)
    app = GroundStationApp(feed)
    app.draft.edit(HOVERING.plans.mission[:2])
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await pilot.press("s")
        await until(pilot, lambda: words in notices(app))
        assert not app.screen.is_modal
    assert feed.requests == []


async def test_a_paused_mission_goes_on_beside_an_edited_plan_and_the_question_tells_which(feed):
    feed.snapshot = snapshot_with(HOVERING, mission={"state": mavlink.MISSION_STATE_PAUSED})
    app = GroundStationApp(feed)
    app.draft.edit(HOVERING.plans.mission[:2])
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("s")
        await until(pilot, lambda: app.screen.is_modal)
        assert "vehicle's own mission, not the plan that you edited" in app.screen._question
        await pilot.press("escape")
        await confirm(pilot, "s")
        await until(pilot, lambda: feed.requests == [("plans.start_mission", ("arm", False))])


async def test_the_question_tells_how_far_the_missions_first_item_is(feed):
    far = snapshot_with(
        HOVERING,
        position={"p": (300.0, 0.0, -20.0)},
        mission={"state": mavlink.MISSION_STATE_NOT_STARTED, "current": 0},
    )
    assert "It is 296 m from here to its first item." in start_question(far)
    near = snapshot_with(far, position={"p": (3.0, 0.0, -20.0)})
    assert start_question(near) == "Fly the mission?"
    away = new_area(STAY_IN, (900.0, 0.0), HOME, (0.0, 0.0, 0.0))
    assert "OUTSIDE: legs to " in start_question(snapshot_with(near, plans={"fence": away}))


@pytest.mark.parametrize(
    ("state", "current", "landed", "question"),
    [
        (mavlink.MISSION_STATE_NOT_STARTED, 0, IN_AIR, "Fly the mission?"),
        (mavlink.MISSION_STATE_NOT_STARTED, 2, IN_AIR, "Fly the mission from item 2?"),
        (mavlink.MISSION_STATE_ACTIVE, 2, IN_AIR, "Fly on with the mission from item 2? It is being flown."),
        (mavlink.MISSION_STATE_PAUSED, 2, IN_AIR, "Resume the mission from item 2?"),
        (mavlink.MISSION_STATE_PAUSED, 0, IN_AIR, "Resume the mission?"),
        (mavlink.MISSION_STATE_PAUSED, 2, ON_GROUND, "Resume the mission from item 2?"),
        (mavlink.MISSION_STATE_PAUSED, 0, ON_GROUND, "Fly the mission from its first item?"),
        (
            mavlink.MISSION_STATE_PAUSED,
            3,
            ON_GROUND,
            "Fly the mission from item 3? If it was broken off there, it begins with its first item.",
        ),
        (mavlink.MISSION_STATE_COMPLETE, 3, IN_AIR, "Fly the mission again from its first item?"),
    ],
)
def test_the_question_before_a_mission_names_the_item_that_it_begins_with(state, current, landed, question):
    mission = {"state": state, "current": current, "total": 4}
    s = snapshot_with(HOVERING, status={"landed_state": landed}, mission=mission, plans={"mission": ()})
    assert start_question(s) == question


def test_of_a_mission_that_is_done_the_distance_to_its_first_item_is_told():
    items = (waypoint(90.0, 0.0, 20.0), waypoint(300.0, 0.0, 20.0))
    mission = {"state": mavlink.MISSION_STATE_COMPLETE, "current": 1, "total": 2}
    s = snapshot_with(HOVERING, position={"p": (300.0, 0.0, -20.0)}, mission=mission, plans={"mission": items})
    assert "It is 210 m from here to its first item." in start_question(s)
    assert "It is" not in start_question(snapshot_with(s, position={"p": (90.0, 0.0, -20.0)}))


@pytest.mark.long
@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("t", "g goes to another height"),
        ("A", "There is no alert"),
    ],
)
async def test_a_key_that_has_nothing_to_do_says_so(feed, key, words):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press(key)
        await until(pilot, lambda: words in " ".join(notices(app).split()))
        assert feed.requests == []


async def test_a_mission_of_a_disarmed_vehicle_is_armed_for_as_the_question_says(feed):
    feed.snapshot = snapshot_with(
        HOVERING,
        status={"armed": False, "landed_state": mavlink.MAV_LANDED_STATE_ON_GROUND},
        mission={"current": 0, "state": 2},
    )
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("s")
        await until(pilot, lambda: "Arm and fly the mission? The propellers will turn." in screen_text(app))
        await pilot.press("y")
        await until(pilot, lambda: feed.requests == [("plans.start_mission", ("arm", True))])


async def test_the_form_of_a_speed_begins_with_the_one_that_was_asked_for_last(feed):
    order = SpeedOrder(3.0, over_ground=True, mode=HOVERING.status.mode)
    feed.snapshot = snapshot_with(HOVERING, operator={"speed_order": order}, mission={"state": 2})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("c")
        await until(pilot, lambda: "Change speed (asked for: 3 m/s over ground, command)" in screen_text(app))
        assert [field.value for field in app.screen.query(Input)] == ["3", "ground"]


@pytest.mark.parametrize(
    ("state", "up", "question"),
    [
        ("TAKEOFF", 0.4, "Disarm? It is taking off, 0.4 m up: the propellers will stop."),
        ("TAKEOFF", 2.0, "Disarm IN THE AIR? The vehicle will fall."),
        ("IN_AIR", 0.4, "Disarm IN THE AIR? The vehicle will fall."),
        ("ON_GROUND", 0.0, "Disarm? The propellers will stop."),
    ],
)
def test_the_question_before_disarming_says_what_is_true_of_a_take_off(state, up, question):
    landed = getattr(mavlink, f"MAV_LANDED_STATE_{state}")
    s = snapshot_with(HOVERING, status={"landed_state": landed}, position={"p": (0.0, 0.0, -up)})
    assert disarm_question(s) == question
