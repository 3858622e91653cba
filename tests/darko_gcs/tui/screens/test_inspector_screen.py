"""The inspector: every message is listed, found by typing, and opened to its fields."""

import pytest

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.replay_app import ReplayApp
from darko_gcs.tui.screens.dialogs import AskScreen
from darko_gcs.tui.screens.inspector_screen import InspectorScreen
from protocol.dialect import mavlink
from protocol.tlog import read_tlog
from tests.support.gcs.messages import OTHER_VEHICLE, VEHICLE, heartbeat, position
from tests.support.gcs.screens import FakeFeed, screen_text, settled, until
from tests.support.gcs.snapshots import FORWARD
from tests.support.paths import DATA


@pytest.fixture
def feed():
    feed = FakeFeed(FORWARD)
    messages = [heartbeat(armed=True), mavlink.MAVLink_sys_status_message(0, 0, 0, 500, 12400, 340, 94, *[0] * 6)]
    messages += [mavlink.MAVLink_position_target_local_ned_message(0, 1, 0, 4.0, 5.0, -6.0, *[0.0] * 8)]
    for k in range(50):
        sent = [*messages, position(100 * k, 2.5)] if k % 10 == 0 else [position(100 * k, 2.5)]
        receive(feed, sent, 95.5 + 0.1 * k)
    receive(feed, [heartbeat()], 90.0, OTHER_VEHICLE)
    return feed


def receive(feed, messages, now, codec=VEHICLE):
    decoder = feed.traffic._codec
    feed.traffic.take([decoder.decode(codec.encode(message))[0] for message in messages], now)


async def opened(pilot):
    await pilot.press("E")
    await until(pilot, lambda: isinstance(pilot.app.screen, InspectorScreen) and "7/1" in screen_text(pilot.app))


async def test_every_message_of_every_component_has_a_line(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)
        shown = screen_text(app)
        assert "5 of 5 messages" in shown
        assert "Zoom" not in shown  # of maps and charts alone
        (line,) = [line for line in shown.splitlines() if "LOCAL_POSITION_NED" in line and "TARGET" not in line]
        assert line.split() == ["LOCAL_POSITION_NED", "10.0", "10.0", "0.1", "s", "28", "50"]


async def test_typing_finds_messages_by_their_names_components_and_fields(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)
        await pilot.press(*"voltage")
        await until(pilot, lambda: "1 of 5 messages" in screen_text(app) and "SYS_STATUS" in screen_text(app))
        await pilot.press("escape", *"7/1")
        await until(pilot, lambda: "1 of 5" in screen_text(app) and "HEARTBEAT" in screen_text(app))
        await pilot.press("escape", "escape")
        await until(pilot, lambda: not isinstance(app.screen, InspectorScreen))


async def test_a_message_of_the_name_that_was_typed_opens_before_one_with_such_a_field(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)
        await pilot.press(*"status")  # HEARTBEAT has a field system_status
        await until(pilot, lambda: "3 of 5 messages" in screen_text(app))
        await pilot.press("enter")
        await until(pilot, lambda: "voltage_battery" in screen_text(app))


async def test_a_message_opens_to_its_fields_and_closes_again(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)
        await pilot.press(*"local", "enter")
        await until(pilot, lambda: "→ 4" in screen_text(app))
        assert "now/s" not in screen_text(app)
        receive(feed, [position(9000, 3.5)], 100.5)
        feed.now = 100.6
        await until(pilot, lambda: "3.5 m" in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: "now/s" in screen_text(app))


async def test_only_messages_that_come_now_are_shown_on_demand(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)
        await pilot.press("f2")
        await until(pilot, lambda: "4 of 5 messages" in screen_text(app) and "7/1" not in screen_text(app))


async def test_lost_frames_stand_beside_their_component(feed):
    VEHICLE.encode(heartbeat())  # a frame that never arrives
    receive(feed, [heartbeat()], 100.4)
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)
        assert "1 lost (1.5 %)" in screen_text(app)


async def test_a_recording_has_the_same_screen():
    app = ReplayApp(ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "square-flight.tlog", begin=3.0))
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("space", "E")
        await until(pilot, lambda: "255/190" in screen_text(app))
        await pilot.press(*"hybrid", "enter")
        await until(pilot, lambda: "v_hover" in screen_text(app) and "DARKO_HYBRID_STATE" in screen_text(app))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)], ids=["80x24", "120x40", "200x60"])
def test_the_screen_matches_its_snapshot(snap_compare, feed, size):
    async def settle(pilot):
        await opened(pilot)
        if size[0] > 80:
            await pilot.press("down", "down")
        await settled(pilot)

    assert snap_compare(GroundStationApp(feed), terminal_size=size, run_before=settle)


async def test_a_filter_that_nothing_has_says_how_to_clear_it_and_letters_are_no_keys_there(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("E")
        await until(pilot, lambda: "1/1 autopilot" in screen_text(app))
        await pilot.press("f1")
        await until(pilot, lambda: "Keys of this screen" in screen_text(app))
        assert "Mission: load, edit" not in screen_text(app)  # m is typed into the filter
        await pilot.press("escape", *"zzz")
        await until(pilot, lambda: "(Esc clears it): 0 of 5 messages" in screen_text(app))


async def test_it_sorts_by_rate_and_by_age_within_each_component(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)

        def names():
            words = [line.split() for line in screen_text(app).splitlines() if line.strip()]
            return [first for first, *_ in words if "_" in first]

        await pilot.press("f4")
        await until(pilot, lambda: "by rate" in screen_text(app) and "▾now/s" in screen_text(app))
        assert names()[0] == "LOCAL_POSITION_NED"
        await pilot.press("f4")
        await until(pilot, lambda: "by age" in screen_text(app) and "▾age" in screen_text(app))


@pytest.mark.long
async def test_a_rate_is_asked_of_the_vehicle_and_only_of_the_one_that_is_shown(feed):
    app = GroundStationApp(feed)
    told = []
    app.notify = lambda text, **_: told.append(text)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)
        await pilot.press(*"sys_status", "f5")
        await until(pilot, lambda: isinstance(app.screen, AskScreen))
        await pilot.press("5", "enter")
        number = mavlink.MAVLINK_MSG_ID_SYS_STATUS
        await until(pilot, lambda: ("set_message_rate", number, 5.0) in feed.requests)
        await until(pilot, lambda: isinstance(app.screen, InspectorScreen))
        await pilot.press("escape", *"7/1")
        await until(pilot, lambda: "1 of 5" in screen_text(app))
        await pilot.press("f5")
        await until(pilot, lambda: told == ["Only the rates of the vehicle that is shown can be set"])


async def test_an_open_message_is_named_and_what_is_typed_filters_nothing(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)
        await pilot.press(*"local", "enter")
        await until(pilot, lambda: "LOCAL_POSITION_NED of 1/1 autopilot, 10.0/s" in screen_text(app))
        await pilot.press("r")
        await pilot.press("escape")
        await until(pilot, lambda: "filter 'local' (Esc clears it)" in screen_text(app))


async def test_the_footer_says_what_esc_does(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)
        assert "esc Back" in screen_text(app)
        await pilot.press("l")
        await until(pilot, lambda: "esc Clear" in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: "esc Back" in screen_text(app))
