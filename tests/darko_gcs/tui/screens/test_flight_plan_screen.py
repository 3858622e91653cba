"""The flight plan screen: what it shows, and which keys ask before they act."""

import pytest
from textual.widgets import Input

from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.map_panel import MovableMap
from darko_gcs.tui.screens.dialogs import ConfirmScreen
from darko_gcs.tui.screens.flight_plan_screen import FlightPlanScreen
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.screens.messages_screen import MessagesScreen
from protocol.dialect import mavlink
from protocol.flight_plans.plan_package import unpack_plan
from tests.support.gcs.planned_snapshots import LAPS, P1, STDBY, after, planned
from tests.support.gcs.screens import FakeFeed, screen_text, settled, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.plans import VOLIERE

SIZES = ((80, 24), (120, 40), (200, 60))


class Session:
    """The screen on a feed whose vehicle flies a plan."""

    def __init__(self, mode="FLIGHT_PLAN", snapshot=None):
        self.vehicle, self.s = planned(mode)
        self.feed = FakeFeed(snapshot or self.s)
        self.app = GroundStationApp(self.feed)

    def show(self, *messages):
        self.feed.snapshot = after(self.feed.snapshot, *messages)

    @property
    def text(self):
        return screen_text(self.app)

    @property
    def map(self):
        return self.app.screen.query_one(MovableMap)


async def opened(pilot, app):
    await pilot.press("b")
    await until(pilot, lambda: isinstance(app.screen, FlightPlanScreen) and "Events" in screen_text(app))
    await until(pilot, lambda: "in flight 0:09.0" in screen_text(app) or "no flight plan" in screen_text(app))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES)
async def test_it_fits_the_terminal(size):
    session = Session()
    async with session.app.run_test(size=size) as pilot:
        await opened(pilot, session.app)
        await until(pilot, lambda: "^f Fly" in session.text)  # the footer comes last
        text = session.text
        for part in (
            "2 Standby", "0:01.0", "flown", "stay wp=A", "── flight", "t Take off", "▶ s Stand by", "── figures",
            "✗f5 Camera", "── other blocks", "k Engine off", "◆HOME", "·p1", "STDBY", "laps", "0..9 m",
            "0:50.0 Engine off -> Takeoff: datalink_time > 10", "^f Fly", "space Hold",
        ):  # fmt: skip
            assert part in text, part
        assert "_R1" not in text
        assert len(text.splitlines()) == size[1]


async def test_a_plans_key_acts_when_it_is_pressed_twice():
    session = Session()
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        await pilot.press("t")
        await until(pilot, lambda: "t again: Take off (block Takeoff)" in session.text)
        assert session.feed.requests == []
        await pilot.press("t")
        assert session.feed.requests == [("flight_plan.jump_to_block", 1)]


async def test_a_second_press_that_comes_late_or_after_another_key_is_a_first_one():
    session = Session()
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        await pilot.press("t", "s", "t")
        session.feed.now += 5.0
        await until(pilot, lambda: session.app.screen.now == session.feed.now)
        await pilot.press("t")
        assert session.feed.requests == []


async def test_control_and_function_keys_of_a_plan_work():
    session = Session()
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        await pilot.press("ctrl+l", "ctrl+l")
        assert session.feed.requests == [("flight_plan.jump_to_block", 5)]
        await pilot.press("f5", "f5")
        await until(pilot, lambda: "Block Camera is not flown: call CameraOn()" in session.text)
        assert len(session.feed.requests) == 1


async def test_flight_keys_do_nothing_here_and_others_open_their_screens():
    session = Session()
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        await pilot.press("a", "d", "r", "h", "v", "g")
        await until(pilot, lambda: "g: no block has this key" in session.text)
        assert session.feed.requests == []
        assert isinstance(session.app.screen, FlightPlanScreen)
        await pilot.press("e")
        await until(pilot, lambda: isinstance(session.app.screen, MessagesScreen))


async def test_plans_keys_act_on_this_screen_only():
    session = Session()
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(session.app.screen, FlightScreen))
        await pilot.press("k")
        await until(pilot, lambda: isinstance(session.app.screen, ConfirmScreen) and "control" in session.text)
        await pilot.press("n")
        assert session.feed.requests == []


async def test_a_block_of_the_list_is_entered_after_a_question():
    session = Session()
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        await pilot.press("up", "enter")  # the block in force is highlighted at first
        await until(pilot, lambda: "Enter block Takeoff? The vehicle leaves Standby." in session.text)
        await pilot.press("n")
        assert session.feed.requests == []
        await pilot.press("enter", "y")
        await until(pilot, lambda: session.feed.requests == [("flight_plan.jump_to_block", 1)])


async def test_flying_and_holding_ask():
    session = Session("HOLD")
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        assert "not flown: HOLD" in session.text
        await pilot.press("ctrl+f")
        await until(pilot, lambda: "It continues in block Standby" in session.text)
        await pilot.press("y")
        await until(pilot, lambda: session.feed.requests == [("flight_plan.start",)])
        await pilot.press("space")
        await until(pilot, lambda: "Stop and hover here?" in session.text)
        await pilot.press("y")
        await until(pilot, lambda: session.feed.requests[-1] == ("hold",))


async def choose_on_map(pilot, session, number):
    """Choose a waypoint in the table, then go to the map."""
    session.app.screen.points.choose(number)
    session.map.focus()
    await until(pilot, lambda: session.map.chosen == number and session.app.focused is session.map)


async def test_arrows_on_the_map_move_the_chosen_waypoint_and_ask_once():
    session = Session()
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        await choose_on_map(pilot, session, STDBY)
        await pilot.press("right")
        await until(pilot, lambda: "Move STDBY?" in session.text)
        await pilot.press("y")
        await until(pilot, lambda: session.feed.requests == [("flight_plan.move_waypoint", STDBY, (1.0, 0.0, 2.0))])
        session.show(*session.vehicle.moved(STDBY, "STDBY", 1.0, 0.0))
        await until(pilot, lambda: session.map.snapshot.flight_plan.points[STDBY].position[0] == 1.0)
        session.feed.now += 2.0
        await until(pilot, lambda: session.map.now == session.feed.now)
        await pilot.press("up", "pageup")
        await until(pilot, lambda: len(session.feed.requests) == 3)
        assert session.feed.requests[1:] == [
            ("flight_plan.move_waypoint", STDBY, (1.0, 0.5, 2.0)),
            ("flight_plan.move_waypoint", STDBY, (1.0, 0.5, 2.5)),  # on from where it is about to be
        ]
        await choose_on_map(pilot, session, P1)
        await pilot.press("left")
        await until(pilot, lambda: "Move p1?" in session.text)


async def test_shift_and_arrows_move_from_anywhere_by_the_chosen_step():
    session = Session()
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        await choose_on_map(pilot, session, STDBY)
        session.app.screen.blocks.focus()
        await pilot.press("less_than_sign", "less_than_sign")
        await until(pilot, lambda: "step 0.1 m" in session.text)
        await pilot.press("shift+down", "y")
        await until(pilot, lambda: session.feed.requests == [("flight_plan.move_waypoint", STDBY, (0.5, -0.1, 2.0))])


@pytest.mark.long
async def test_the_mouse_drags_a_waypoint():
    session = Session()
    async with session.app.run_test(size=(120, 40)) as pilot:
        await opened(pilot, session.app)
        column, row = session.map._cell_of((1.5, 1.5))
        at = (column + 1, row + 1)  # the border is one cell wide
        scale = session.map._view[0]
        await pilot.mouse_down(session.map, offset=at)
        await pilot.hover(session.map, offset=(at[0] + 4, at[1] - 2))
        await pilot.mouse_up(session.map, offset=(at[0] + 4, at[1] - 2))
        await until(pilot, lambda: "Move p1?" in session.text)
        await pilot.press("y")
        await until(pilot, lambda: len(session.feed.requests) == 1)
        name, number, (x, y, z) = session.feed.requests[0]
        assert (name, number, z) == ("flight_plan.move_waypoint", P1, 2.0)
        assert (x - 1.5, y - 1.5) == (pytest.approx(2 * scale, abs=scale), pytest.approx(2 * scale, abs=scale))


async def test_a_click_on_a_waypoint_chooses_it_and_moves_nothing():
    session = Session()
    async with session.app.run_test(size=(120, 40)) as pilot:
        await opened(pilot, session.app)
        column, row = session.map._cell_of((1.5, 1.5))
        await pilot.click(session.map, offset=(column + 1, row + 1))
        await until(pilot, lambda: session.map.chosen == P1)
        assert session.app.screen.points.chosen == P1
        assert (session.feed.requests, isinstance(session.app.screen, ConfirmScreen)) == ([], False)


async def test_a_waypoint_is_moved_by_numbers():
    session = Session()
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        session.app.screen.points.choose(P1)
        session.app.screen.points.focus()
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(session.app.focused, Input) and "Move waypoint p1" in session.text)
        session.app.focused.value = "2.25"
        await pilot.press("enter")
        await until(pilot, lambda: session.feed.requests == [("flight_plan.move_waypoint", P1, (2.25, 1.5, 2.0))])


async def test_a_variable_is_set_within_its_limits():
    session = Session()
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        session.app.screen.query_one("#plan-settings").focus()
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(session.app.focused, Input))
        session.app.focused.value = "12"
        await pilot.press("enter")
        await until(pilot, lambda: "12 is outside 0..9" in session.text)
        session.app.focused.value = "4"
        await pilot.press("enter")
        await until(pilot, lambda: session.feed.requests == [("flight_plan.set_variable", LAPS, 4.0)])


async def test_it_follows_the_vehicle():
    session = Session()
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        remark = session.vehicle.event("Block holds: no such thing", mavlink.DARKO_PLAN_EVENT_KIND_REMARK, 59.0)
        session.show(session.vehicle.status(3, 61_000), remark)
        await until(pilot, lambda: "▶   Route" in session.text and "0:59.0 Block holds" in session.text)
        assert "3 Route" in session.text


async def test_without_a_plan_it_says_so_and_takes_no_key():
    session = Session(snapshot=HOVERING)
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        assert "The vehicle has no flight plan" in session.text
        session.map.focus()
        await pilot.press("t", "t", "up", "ctrl+f", "tab", "enter")
        await settled(pilot)
        assert session.feed.requests == []


async def test_a_silent_vehicle_is_sent_nothing():
    session = Session()
    session.feed.snapshot = snapshot_with(session.s, link={"lost": True})
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        await pilot.press("t", "t")
        await until(pilot, lambda: "The vehicle is silent: nothing was sent" in session.text)
        assert session.feed.requests == []


async def test_a_recording_is_sent_nothing():
    session = Session()
    session.feed.station = None
    async with session.app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, session.app)
        session.map.focus()
        await pilot.press("t", "t", "right")
        await until(pilot, lambda: "This is a recording" in session.text)
        assert not isinstance(session.app.screen, ConfirmScreen)


async def test_a_plan_is_loaded_from_a_file_after_it_was_checked(tmp_path):
    broken = tmp_path / "broken.xml"
    broken.write_text("<flight_plan>")
    session = Session(snapshot=HOVERING)
    async with session.app.run_test(size=(120, 40)) as pilot:
        await opened(pilot, session.app)
        await pilot.press("ctrl+o")
        await until(pilot, lambda: isinstance(session.app.focused, Input))
        session.app.focused.value = str(broken)
        await pilot.press("enter")
        await until(pilot, lambda: "broken.xml:1:" in session.text)
        assert session.feed.requests == []
        session.app.focused.value = str(VOLIERE)
        await pilot.press("enter")
        await until(pilot, lambda: [name for name, *_ in session.feed.requests] == ["flight_plan.load"])


@pytest.mark.long
async def test_a_plan_is_loaded_with_what_its_names_mean(tmp_path):
    names = tmp_path / "names.toml"
    names.write_text("[functions]\ncamera = 0\n")
    session = Session(snapshot=HOVERING)
    async with session.app.run_test(size=(120, 40)) as pilot:
        await opened(pilot, session.app)
        await pilot.press("ctrl+o")
        await until(pilot, lambda: isinstance(session.app.focused, Input))
        plan, meanings = session.app.screen.query(Input)
        plan.value, meanings.value = str(VOLIERE), str(tmp_path / "nowhere.toml")
        await pilot.press("enter")
        await until(pilot, lambda: "nowhere.toml: cannot be read" in session.text)
        meanings.value = str(names)
        await pilot.press("enter")
        await until(pilot, lambda: session.feed.requests)
        ((name, data, *_),) = session.feed.requests
        assert (name, dict(unpack_plan(data, "sent").mapping.functions)) == ("flight_plan.load", {"camera": 0})


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES)
def test_the_screen_matches_its_snapshot(snap_compare, size):
    async def settle(pilot):
        await opened(pilot, pilot.app)
        await settled(pilot)

    assert snap_compare(Session().app, terminal_size=size, run_before=settle)
