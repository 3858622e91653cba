"""Several vehicles on the screen: a line for each, another one active, and commands to one or all."""

import pytest
from textual.widgets import Label

from darko_gcs.state.parts import BatteryReading
from darko_gcs.state.values import LogLine
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.flight_dialogs import FLEET_COMMANDS, id_words
from darko_gcs.tui.screens.dialogs import AskScreen, ChooseScreen, ConfirmScreen
from darko_gcs.tui.widgets.status_bar import FleetStrip, fleet_lines
from protocol.dialect import mavlink
from tests.support.gcs.fleet_feed import FleetFeed, landed, numbered
from tests.support.gcs.planned_snapshots import planned
from tests.support.gcs.screens import notices, screen_text, settled, until

SIZES = [(80, 24), (120, 40), (200, 60)]
WARNING = LogLine(80.0, mavlink.MAV_SEVERITY_WARNING, "Wind is strong")


@pytest.fixture
def feed():
    return FleetFeed(
        numbered(1),
        landed(2, log={"lines": (WARNING,)}),
        numbered(3, status={"mode": "RTL"}, battery={"battery_status": BatteryReading(charge_left=0.08)}),
        numbered(5, link={"lost": True, "heartbeat_at": 60.0}),
        numbered(6, status={"critical": True}),
    )


async def shown(app, pilot):
    """Wait for the strip."""
    await until(pilot, lambda: app.screen.query(FleetStrip) and app.screen.query_one(FleetStrip).size.height > 1)
    await settled(pilot)


def text_of(fleet, active=1, width=120, height=9):
    return ["".join(part for part, _ in line) for line, _ in fleet_lines(fleet, active, 100.5, width, height)]


QUESTIONS = {  # of every screen that commands a vehicle: keys, and how it begins
    "delete": ("mc", "Delete on the vehicle"),
    "upload": ("mDu", "A mission is being flown."),
    "fly from an item": ("mS", "Fly the mission from item 0?"),
    "jump to an item": ("mj", "Continue the mission at item 0?"),
    "fly the flight plan": (("b", "ctrl+f"), "Fly the flight plan?"),
    "hold": (("b", "space"), "Stop and hover here?"),
    "a parameter": (("p", "enter"), "DRK_KPP"),
}


async def choose(app, pilot, label):
    """Choose a command to all from the list."""
    await pilot.press("f")
    await until(pilot, lambda: isinstance(app.screen, ChooseScreen))
    for _ in range([command.label for command in FLEET_COMMANDS].index(label)):
        await pilot.press("down")
    await pilot.press("enter")


def test_a_line_tells_id_mode_arming_law_height_speed_charge_age_and_the_last_warning():
    head, hovering, standing = text_of([numbered(1), landed(2, log={"lines": (WARNING,)})], height=3)
    assert " ".join(head.split()) == "id mode law height speed batt age o next, f to all, w lines"
    assert " ".join(hovering.split()) == "> 1 HOLD ARMED hover linear 3.0 m 0.5 m/s 94 % 0.5 s"
    assert standing.endswith("0.5 s  Wind is strong")
    assert "disarmed" in standing


def test_a_vehicle_on_the_ground_is_not_below_it():
    line = text_of([numbered(1, position={"p": (0.0, 0.0, 0.04), "told_home_p": (0.0, 0.0, 0.0)})], height=2)[1]
    assert " 0.0 m " in line
    assert "-0.0" not in line


def test_a_warning_from_before_the_vehicle_came_back_is_not_told_any_more():
    lost = LogLine(71.0, mavlink.MAV_SEVERITY_WARNING, "Vehicle lost: silent for 3 s")
    back = LogLine(72.0, mavlink.MAV_SEVERITY_NOTICE, "Vehicle is back after 3 s")
    assert text_of([numbered(1, log={"lines": (lost,)})])[1].endswith("silent for 3 s")
    assert text_of([numbered(1, log={"lines": (lost, back)})])[1].endswith("0.5 s")
    assert text_of([numbered(1, log={"lines": (lost, back, WARNING)})])[1].endswith("Wind is strong")


def test_an_old_warning_is_told_only_of_a_vehicle_in_a_failsafe():
    old = WARNING._replace(time=40.0)
    assert text_of([numbered(1, log={"lines": (old,)})])[1].endswith("0.5 s")
    assert text_of([numbered(1, log={"lines": (old,)}, status={"critical": True})])[1].endswith("Wind is strong")


def test_where_there_is_no_room_the_active_vehicle_is_shown_and_the_last_line_tells_of_the_rest():
    fleet = [numbered(n, link={"lost": n == 3}, status={"critical": n == 4}) for n in range(1, 21)]
    lines = fleet_lines(fleet, 15, 100.5, 80, 4)
    assert [system for _, system in lines] == [14, 15, 16, 0]
    last = "".join(part for part, _ in lines[-1][0])
    assert "17 more: 17 armed, 1 lost, 1 in failsafe or crashed" in last


@pytest.mark.parametrize("active", [1, 2, 19, 20])
def test_every_vehicle_can_be_the_active_one_in_sight(active):
    lines = fleet_lines([numbered(n) for n in range(1, 21)], active, 100.5, 80, 4)
    assert len(lines) == 4
    assert active in {system for _, system in lines}


async def test_one_vehicle_has_no_strip_until_the_key_shows_it():
    app = GroundStationApp(FleetFeed(numbered(1)))
    async with app.run_test(size=(80, 24)) as pilot:
        await settled(pilot)
        strip = app.screen.query_one(FleetStrip)
        assert not strip.display
        await pilot.press("w")
        await until(pilot, lambda: strip.display)


@pytest.mark.long
async def test_the_key_shows_a_few_lines_then_all_then_none(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await shown(app, pilot)
        strip = app.screen.query_one(FleetStrip)
        heights = [strip.size.height]
        await pilot.press("w")
        await until(pilot, lambda: strip.size.height != heights[0])
        heights.append(strip.size.height)
        await pilot.press("w")
        await until(pilot, lambda: not strip.display)
    assert heights == [4, 6]


@pytest.mark.long(after=2)
@pytest.mark.parametrize("name", QUESTIONS)
async def test_the_questions_of_every_screen_name_the_vehicle_if_there_are_several(name):
    keys, words = QUESTIONS[name]
    plan, flown = planned("HOLD")[1].flight_plan, mavlink.MISSION_STATE_ACTIVE
    second = numbered(2, parameters={"values": {"DRK_KPP": 1.0}, "total": 1}, mission={"state": flown})
    app = GroundStationApp(FleetFeed(numbered(1), second._replace(flight_plan=plan)))
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("o")
        await until(pilot, lambda: app.screen.snapshot.identity.source == (2, 1))
        for key in keys:
            await pilot.press(key)
            await settled(pilot)
        await until(pilot, lambda: app.screen.is_modal)
        assert str(app.screen.query_one("#question", Label).content).startswith(f"Vehicle 2: {words}")


async def test_the_next_vehicle_is_shown_and_commanded_by_key_and_the_question_names_it(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40)) as pilot:
        await shown(app, pilot)
        await pilot.press("o")
        await until(pilot, lambda: app.screen.snapshot.identity.source == (2, 1))
        await pilot.press("a")
        await until(pilot, lambda: isinstance(app.screen, ConfirmScreen))
        assert "Vehicle 2: Arm?" in screen_text(app)
        await pilot.press("y")
        await until(pilot, lambda: feed.asked[2] == [("arm",)])
        await pilot.press("O")
        await until(pilot, lambda: app.screen.snapshot.identity.source == (1, 1))
    assert [system for system, requests in feed.asked.items() if requests] == [2]


async def test_a_click_on_a_line_chooses_its_vehicle(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40)) as pilot:
        await shown(app, pilot)
        await pilot.click(FleetStrip, offset=(10, 3))  # the third, below the head
        await until(pilot, lambda: app.screen.snapshot.identity.source == (3, 1))


async def test_a_command_to_all_asks_once_names_whom_it_moves_and_spares_the_rest(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40)) as pilot:
        await shown(app, pilot)
        await choose(app, pilot, "Land")
        await until(pilot, lambda: isinstance(app.screen, ConfirmScreen))
        question = "Land: 3 vehicles (1, 3, 6)? Running missions are interrupted. 1 is on the ground: not commanded."
        assert str(app.screen.query_one("#question", Label).content) == question
        assert not any(feed.asked.values())
        await pilot.press("y")
        await until(pilot, lambda: any(feed.asked.values()))
    assert feed.asked == {1: [("land",)], 2: [], 3: [("land",)], 5: [], 6: [("land",)]}


async def test_no_is_no_for_all(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await shown(app, pilot)
        await choose(app, pilot, "Hold")
        await until(pilot, lambda: isinstance(app.screen, ConfirmScreen))
        await pilot.press("n")
        await settled(pilot)
    assert not any(feed.asked.values())


async def test_a_vehicle_alone_has_no_next_one_and_says_so():
    app = GroundStationApp(FleetFeed(numbered(1)))
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await settled(pilot)
        await pilot.press("o")
        await until(pilot, lambda: "no other vehicle" in notices(app))


async def test_all_take_off_to_a_height_that_is_asked_once():
    feed = FleetFeed(landed(1), landed(2), landed(3))
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await shown(app, pilot)
        await choose(app, pilot, "Take off")
        await until(pilot, lambda: isinstance(app.screen, AskScreen))
        assert "Take off: 3 vehicles (1-3)." in screen_text(app)
        await pilot.press("backspace", "7", "enter")
        await until(pilot, lambda: all(feed.asked.values()))
    assert feed.asked == {n: [("take_off", 7.0)] for n in (1, 2, 3)}


async def test_what_makes_sense_for_none_is_said_and_not_asked():
    feed = FleetFeed(landed(1), landed(2))
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await shown(app, pilot)
        await choose(app, pilot, "Hold")
        await until(pilot, lambda: "all are on the ground" in notices(app))
        assert not isinstance(app.screen, ConfirmScreen)


def test_ids_are_told_with_neighbours_as_spans():
    assert id_words([1, 2, 3, 5, 9, 8]) == "1-3, 5, 8-9"
    assert id_words([4]) == "4"


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES)
def test_the_screen_of_five_vehicles_matches_its_snapshot(snap_compare, feed, size):
    async def show(pilot):
        await shown(pilot.app, pilot)

    assert snap_compare(GroundStationApp(feed), terminal_size=size, run_before=show)
