"""Flight by hand, the pre-flight list and failures, by keys."""

import gc
import sys
from time import monotonic

import pytest
from textual import events

from darko_gcs.state.message_log import add_line
from darko_gcs.state.sticks import DEAD_MAN_TIME, Sticks
from darko_gcs.state.text import RESTARTED
from darko_gcs.tui.app import GroundStationApp, run_screens
from darko_gcs.tui.failure_dialog import DURATIONS, failing_now
from darko_gcs.tui.screens.dialogs import ChooseScreen
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.screens.pilot_screen import ENTRY_TIME, PilotScreen
from darko_gcs.tui.screens.preflight_screen import PreflightScreen, hindrances
from protocol.dialect import mavlink
from protocol.names import FAILURE_TYPES, FAILURE_UNITS, Mode
from tests.support.gcs.screens import FakeFeed, confirm, notices, screen_text, settled, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.gcs.virtual_gamepad import VirtualGamepad

MOST_SEARCHED = 50_000  # objects in a search of the young: 30 ms
MANUAL = snapshot_with(HOVERING, status={"mode": Mode.POSCTL.name})
STANDING = snapshot_with(
    HOVERING,
    status={"armed": False, "prearm_ok": False, "landed_state": mavlink.MAV_LANDED_STATE_ON_GROUND},
)


@pytest.fixture
def feed():
    return FakeFeed(HOVERING)


@pytest.fixture
def app(feed):
    return GroundStationApp(feed)


def sticks(feed):
    return [request[1] for request in feed.requests if request[0] == "steer"]


async def opened(pilot, app, key="y"):
    await until(pilot, lambda: "172 W" in screen_text(app))
    await confirm(pilot, key)
    await until(pilot, lambda: isinstance(app.screen, PilotScreen))


async def test_it_asks_sends_centred_sticks_first_then_asks_for_the_mode_and_keys_deflect_them(feed, app):
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await until(pilot, lambda: len(sticks(feed)) > 2)
        assert set(sticks(feed)) == {Sticks()}
        assert ("set_mode", Mode.POSCTL) not in feed.requests
        feed.now += 0.3
        await until(pilot, lambda: ("set_mode", Mode.POSCTL) in feed.requests)
        assert "waiting for POSCTL" in screen_text(app)
        feed.snapshot = MANUAL
        await until(pilot, lambda: "POSCTL: you fly" in screen_text(app))
        await pilot.press("up")
        await until(pilot, lambda: sticks(feed)[-1] == Sticks(forward=0.5))
        assert "forward 50%" in screen_text(app)
        await pilot.press("plus", "d")
        await until(pilot, lambda: sticks(feed)[-1] == Sticks(forward=1.0, clockwise=1.0))
        await pilot.press("space")
        await until(pilot, lambda: sticks(feed)[-1] == Sticks())
        assert [request for request in feed.requests if request[0] != "steer"] == [("set_mode", Mode.POSCTL)]


async def test_after_it_is_left_the_vehicle_holds_and_no_stick_is_sent(feed, app):
    async with app.run_test(size=(80, 24)) as pilot:
        feed.snapshot = MANUAL
        await opened(pilot, app)
        await until(pilot, lambda: len(sticks(feed)) > 2)
        await pilot.press("escape")
        await until(pilot, lambda: not isinstance(app.screen, PilotScreen))
        assert feed.requests[-1] == ("hold",)
        count = len(feed.requests)
        await settled(pilot)
        assert len(feed.requests) == count


async def test_a_key_that_is_still_held_when_it_ends_reaches_no_other_screen_until_it_was_let_go(feed, app):
    async with app.run_test(size=(80, 24)) as pilot:
        feed.snapshot = MANUAL
        await opened(pilot, app)
        begun = monotonic()

        def repeat(after):
            event = events.Key("d", "d")
            event.time = begun + after  # as the terminal gives it
            app.post_message(event)

        repeat(0.0)
        await until(pilot, lambda: Sticks(clockwise=0.5) in sticks(feed))
        feed.snapshot = snapshot_with(HOVERING, status={"mode": "RTL"})
        await until(pilot, lambda: isinstance(app.screen, FlightScreen))
        for after in (0.5, 0.53, 0.56, 1.0, 1.5):
            repeat(after)
        await settled(pilot)
        assert isinstance(app.screen, FlightScreen)
        repeat(1000.0)
        await until(pilot, lambda: "Disarm IN THE AIR?" in screen_text(app))


async def test_a_key_right_after_the_end_was_meant_for_the_sticks(feed, app):
    async with app.run_test(size=(80, 24)) as pilot:
        feed.snapshot = MANUAL
        await opened(pilot, app)
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, FlightScreen))
        for after, is_taken in ((-0.1, False), (1000.0, True)):
            event = events.Key("s", "s")
            event.time += after
            app.post_message(event)
            await settled(pilot)
            assert ("no mission" in screen_text(app) or "Fly" in screen_text(app)) is is_taken


@pytest.mark.parametrize("way_out", ["escape", "silence"])
@pytest.mark.parametrize("ends", ["RTL", "HOLD"])
async def test_behind_its_end_the_flying_keys_only_tell_it_until_escape_or_two_seconds_without_them(
    feed, app, ends, way_out
):
    """However late and however often they are pressed: s and a would begin the mission and arm."""
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        feed.snapshot = MANUAL
        await opened(pilot, app)
        await until(pilot, lambda: len(sticks(feed)) > 2)
        feed.snapshot = snapshot_with(HOVERING, status={"mode": ends})
        await until(pilot, lambda: isinstance(app.screen, FlightScreen))
        ended, count = monotonic(), len(feed.requests)

        def press(key, after):
            event = events.Key(key, key if len(key) == 1 else None)
            event.time = ended + after
            app.post_message(event)

        for k in range(8):
            press("sadw"[k % 4], 0.1 + 1.5 * k)
        await settled(pilot)
        assert isinstance(app.screen, FlightScreen)
        assert len(feed.requests) == count
        assert "flight by hand has ended" in " ".join(notices(app).split())
        last = 0.1 + 1.5 * 7
        if way_out == "escape":
            press("escape", last + 0.5)
        press("d", last + (1.0 if way_out == "escape" else 2.1))
        await until(pilot, lambda: "Disarm IN THE AIR?" in screen_text(app))


async def test_no_long_search_for_garbage_keeps_the_sticks_waiting(feed, app, monkeypatch):
    """One of 0.3 s came every 3 s, one of 1.6 s once: the vehicle holds after 0.5 s without sticks."""
    before = gc.get_threshold()
    monkeypatch.setattr(type(app), "run", lambda _app: gc.get_threshold())
    try:
        young, middle, _ = run_screens(app)
    finally:
        gc.set_threshold(*before)
    assert young * middle <= MOST_SEARCHED
    async with app.run_test(size=(80, 24)) as pilot:
        feed.snapshot = MANUAL
        frozen = gc.get_freeze_count()
        await opened(pilot, app)
        await until(pilot, lambda: gc.get_freeze_count() > frozen)  # what is there is not searched again


async def test_a_pilot_who_touches_nothing_flies_no_longer(feed, app):
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        feed.snapshot = MANUAL
        await opened(pilot, app)
        feed.now += DEAD_MAN_TIME - 0.5
        await settled(pilot)
        await pilot.press("x")  # any key shows that somebody is there
        feed.now += 1.0
        await settled(pilot)
        assert isinstance(app.screen, PilotScreen)
        feed.now += DEAD_MAN_TIME
        await until(pilot, lambda: not isinstance(app.screen, PilotScreen))
        await until(pilot, lambda: "No key for 10 s" in " ".join(notices(app).split()))


@pytest.mark.long
@pytest.mark.parametrize(("mode", "words"), [("HOLD", "did not enter POSCTL"), ("POSCTL", "left POSCTL for RTL")])
async def test_it_ends_with_the_mode_or_if_the_vehicle_does_not_enter_it(feed, app, mode, words):
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        feed.snapshot = snapshot_with(HOVERING, status={"mode": mode})
        await opened(pilot, app)
        await settled(pilot)
        feed.now += ENTRY_TIME + 0.1
        if mode == "POSCTL":
            feed.snapshot = snapshot_with(HOVERING, status={"mode": "RTL"})
        await until(pilot, lambda: words in " ".join(notices(app).split()))
        assert not isinstance(app.screen, PilotScreen)


async def test_a_disarmed_vehicle_is_not_flown_by_hand(feed, app):
    feed.snapshot = snapshot_with(HOVERING, status={"armed": False})
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press("y")
        await until(pilot, lambda: "arm it first" in notices(app))
        assert feed.requests == []


async def test_a_gamepad_flies_it_and_one_that_is_unplugged_is_silence(feed, app):
    feed.snapshot = MANUAL
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        with VirtualGamepad() as pad:
            await opened(pilot, app, "Y")
            assert "Virtual Controller" in screen_text(app)
            pad.move("left y", -32768)
            await until(pilot, lambda: Sticks(up=1.0) in sticks(feed))
            feed.now += 2 * DEAD_MAN_TIME  # its sticks are held: no key is wanted
            await settled(pilot)
            pad.unplug()
            await until(pilot, lambda: "The gamepad is gone" in notices(app))
            count = len(feed.requests)
            await settled(pilot)
            assert len(feed.requests) == count


@pytest.mark.long
async def test_without_a_gamepad_there_is_a_line(feed, app, monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await confirm(pilot, "Y")
        await until(pilot, lambda: "darko[joystick]" in notices(app))


def test_what_hinders_is_read_from_the_texts_of_any_autopilot():
    s = add_line(HOVERING, 10.0, 4, "PreArm: Compass not calibrated")
    for text in ("Preflight Fail: no GPS", "Arming refused: moving at 1.0 m/s; battery at 3 %", "Take-off complete"):
        s = add_line(s, 20.0, 4, text)
    s = add_line(s, 21.0, 4, "Pre-arm: ready")
    assert hindrances(s, 15.0) == ["no GPS", "moving at 1.0 m/s", "battery at 3 %"]
    assert hindrances(s, 0.0)[0] == "Compass not calibrated"


async def test_the_list_asks_the_vehicle_and_follows_it(feed, app):
    feed.snapshot = snapshot_with(STANDING, status={"unhealthy": mavlink.MAV_SYS_STATUS_SENSOR_GPS})
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press("i")
        await until(pilot, lambda: isinstance(app.screen, PreflightScreen) and "asking why" in screen_text(app))
        assert feed.requests == [("check_arming",)]
        assert "! gps: not healthy" in screen_text(app)
        feed.now += 3.0
        await until(pilot, lambda: "it does not say why" in screen_text(app))
        feed.snapshot = add_line(feed.snapshot, feed.now, 4, "Pre-arm: not upright (80 deg from the vertical)")
        await until(pilot, lambda: "✗ not upright (80 deg" in screen_text(app))
        assert "NOT READY" in screen_text(app)
        feed.snapshot = add_line(feed.snapshot, feed.now, 4, "Mission would be denied: item 4 is outside the fence")
        await until(pilot, lambda: "! Mission would be denied: item 4 is outside the fence" in screen_text(app))
        feed.now += 1.0
        feed.snapshot = snapshot_with(feed.snapshot, status={"prearm_ok": True})
        await pilot.press("r")
        await until(pilot, lambda: "Ready to arm" in screen_text(app))
        assert feed.requests == [("check_arming",)] * 2


async def chosen(pilot, app, title, words):
    """Choose the row of a list that begins with some words."""
    await until(pilot, lambda: isinstance(app.screen, ChooseScreen) and title in screen_text(app))
    rows = app.screen.query_one("OptionList")
    rows.highlighted = next(k for k, row in enumerate(rows.options) if str(row.prompt).startswith(words))
    await pilot.press("enter")


async def answered(pilot, app, question):
    await until(pilot, lambda: question in " ".join(screen_text(app).split()))
    await until(pilot, lambda: hasattr(app.screen, "shown_at") and app.screen.is_mounted)
    await pilot.press("y")


async def test_leave_is_asked_for_before_a_failure_is_chosen_also_while_no_parameter_is_known(feed, app):
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press("F")
        await until(pilot, lambda: feed.requests == [("fetch_parameter", "SYS_FAILURE_EN")])
        assert isinstance(app.screen, FlightScreen)
        feed.snapshot = snapshot_with(HOVERING, parameters={"values": {"SYS_FAILURE_EN": 0.0}})
        await until(pilot, lambda: "SYS_FAILURE_EN is 0. Set" in " ".join(screen_text(app).split()))


async def test_a_vehicle_without_the_parameter_judges_failures_by_itself(monkeypatch, feed, app):
    monkeypatch.setattr("darko_gcs.tui.failure_dialog.MAX_POLLS", 1)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press("F")
        await until(pilot, lambda: "What shall fail" in screen_text(app))


async def test_the_list_of_failures_says_what_is_failing_now(feed, app):
    said = (
        "Failure injected: barometer stuck", f"{RESTARTED[0].upper()}{RESTARTED[1:]}", "Failure injected: GNSS off",
        "Failure injected: motors stuck", "Failure injected: pitot tube off", "Healed: motor 1", "Healed: pitot tube",
    )  # fmt: skip
    s = snapshot_with(HOVERING, parameters={"values": {"SYS_FAILURE_EN": 1.0}})
    for text in said:
        s = add_line(s, 1.0, 4, text)
    assert failing_now(s) == {"GNSS": "off", "motor 2": "stuck"}
    feed.snapshot = s
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press("F")
        await until(pilot, lambda: "Failing now: GNSS off, motor 2 stuck" in " ".join(screen_text(app).split()))


async def test_a_flight_panel_of_one_page_says_so(app):
    async with app.run_test(size=(120, 50), notifications=True) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press("n")
        await until(pilot, lambda: "The flight panel has one page" in notices(app))


async def test_a_failure_is_chosen_asked_about_and_injected(feed, app):
    feed.snapshot = snapshot_with(HOVERING, parameters={"values": {"SYS_FAILURE_EN": 1.0}})
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press("F")
        await chosen(pilot, app, "What shall fail", "GNSS")
        await until(pilot, lambda: "says or does nothing" in screen_text(app))
        rows = [str(row.prompt).split()[0] for row in app.screen.query_one("OptionList").options]
        assert (rows[0], rows[-1]) == ("off", "ok")  # what ends a failure is not chosen by two keys in a row
        await chosen(pilot, app, "GNSS: how does it fail", "off")
        await chosen(pilot, app, "For how long", "until it is ended")
        assert feed.requests == []
        await answered(pilot, app, "Have the GNSS fail: off? IT IS IN THE AIR.")
        gps, off = FAILURE_UNITS["gps"], FAILURE_TYPES["off"]
        await until(
            pilot, lambda: feed.requests == [("inject_failure", ("unit", gps), ("failure", off), ("instance", 0))]
        )


async def test_a_failure_for_some_seconds_is_ended_by_the_station(monkeypatch, feed, app):
    monkeypatch.setitem(DURATIONS, "2 s", 0.1)
    feed.snapshot = snapshot_with(HOVERING, parameters={"values": {"SYS_FAILURE_EN": 1.0}})
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press("F")
        await chosen(pilot, app, "What shall fail", "GNSS")
        await chosen(pilot, app, "GNSS: how does it fail", "off")
        await chosen(pilot, app, "For how long", "2 s")
        await answered(pilot, app, "Have the GNSS fail: off, for 2 s? IT IS IN THE AIR.")
        await until(pilot, lambda: len(feed.requests) == 2)
        failures = [dict(request[1:])["failure"] for request in feed.requests]
        assert failures == [FAILURE_TYPES["off"], FAILURE_TYPES["ok"]]
        assert len({dict(request[1:])["unit"] for request in feed.requests}) == 1


async def test_the_link_is_off_as_long_as_the_vehicle_says(feed, app):
    feed.snapshot = snapshot_with(HOVERING, parameters={"values": {"SYS_FAILURE_EN": 1.0}})
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press("F")
        await chosen(pilot, app, "What shall fail", "link")
        await chosen(pilot, app, "link: how does it fail", "off")
        await answered(pilot, app, "Have the link fail: off? IT IS IN THE AIR.")
        await until(pilot, lambda: len(feed.requests) == 1)


async def test_one_of_two_fails_after_the_vehicle_s_leave_was_offered(feed, app):
    feed.snapshot = snapshot_with(HOVERING, parameters={"values": {"SYS_FAILURE_EN": 0.0}})
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press("F")
        await answered(pilot, app, "SYS_FAILURE_EN is 0. Set")
        await until(pilot, lambda: feed.requests == [("set_parameter", "SYS_FAILURE_EN", 1.0)])
        await until(pilot, lambda: isinstance(app.screen, ChooseScreen))
        assert "optical flow" not in screen_text(app)  # DarkO has none
        await chosen(pilot, app, "What shall fail", "elevon")
        await chosen(pilot, app, "elevon: how does it fail", "ok")
        await chosen(pilot, app, "Which one", "2 (right)")
        await answered(pilot, app, "End the failure of the elevon, 2 (right)?")
        await until(pilot, lambda: feed.requests[-1][-1] == ("instance", 2))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)], ids=["80x24", "120x40", "200x60"])
@pytest.mark.parametrize(("key", "flight"), [("y", MANUAL), ("i", STANDING)], ids=["by-hand", "pre-flight"])
def test_the_screens_match_their_snapshots(snap_compare, key, flight, size):
    async def settle(pilot):
        await until(pilot, lambda: "172 W" in screen_text(pilot.app))
        if key == "y":
            await confirm(pilot, key)
        else:
            await pilot.press(key)
        await until(pilot, lambda: isinstance(pilot.app.screen, PilotScreen | PreflightScreen))
        await settled(pilot)

    assert snap_compare(GroundStationApp(FakeFeed(flight)), terminal_size=size, run_before=settle)


KEYS = {
    "up": Sticks(forward=0.5), "down": Sticks(forward=-0.5), "right": Sticks(right=0.5), "left": Sticks(right=-0.5),
    "w": Sticks(up=0.5), "s": Sticks(up=-0.5), "d": Sticks(clockwise=0.5), "a": Sticks(clockwise=-0.5),
}  # fmt: skip


@pytest.mark.long
async def test_every_key_of_the_hint_moves_its_stick_and_each_way_out_holds(feed, app):
    async with app.run_test(size=(80, 24)) as pilot:
        feed.snapshot = MANUAL
        await opened(pilot, app)
        for key, wanted in KEYS.items():
            await pilot.press("space", key)
            await until(pilot, lambda wanted=wanted: wanted in sticks(feed)[-3:])
        await pilot.press("space", "minus", "up")
        await until(pilot, lambda: Sticks(forward=0.25) in sticks(feed)[-3:])
        await pilot.press("q")
        await until(pilot, lambda: isinstance(app.screen, FlightScreen))
        assert feed.requests[-1] == ("hold",)


async def test_an_armed_vehicle_is_not_asked_what_hinders_arming(feed, app):
    feed.snapshot = HOVERING
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "172 W" in screen_text(app))
        await pilot.press("i")
        await until(pilot, lambda: "ARMED already" in screen_text(app))
        assert feed.requests == []
