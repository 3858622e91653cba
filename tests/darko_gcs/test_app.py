"""The screens, driven by keys on a feed that needs no network."""

import math
import socket
from dataclasses import replace

import pytest
from textual.widgets import Input

from darko_gcs.app import GroundStation
from darko_gcs.errors import LinkError
from darko_gcs.feed import LiveFeed, ReplayFeed
from darko_gcs.replay_app import ReplayStation
from darko_gcs.screens.dialogs import ConfirmScreen, HelpScreen
from darko_gcs.screens.fly import FlyScreen
from darko_gcs.snapshot import EMPTY
from darko_gcs.station import Station
from darko_gcs.store import note
from darko_gcs.widgets.map import MapPanel
from protocol.dialect.vocabulary import DecisionReason, Way
from protocol.tlog import TlogReader, read_tlog
from tests.darko_gcs.screens import FLYING, ON_THE_WING, FakeFeed, screen_text, settled, until
from tests.support.paths import DATA


@pytest.fixture
def feed():
    return FakeFeed(FLYING)


async def test_arming_asks_first_and_no_means_no(feed):
    feed.snapshot = replace(FLYING, armed=False, landed_state=1)
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("a")
        assert isinstance(app.screen, ConfirmScreen)
        await pilot.press("n")
        assert feed.station.asked == []
        await pilot.press("a", "y")
        assert feed.station.asked == [("arm",)]
    assert feed.closed


async def test_disarming_in_the_air_asks_and_then_means_it(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("d")
        assert isinstance(app.screen, ConfirmScreen)
        await pilot.press("enter")  # the harmless answer has the focus
        assert feed.station.asked == []
        await pilot.press("d", "y")
        assert feed.station.asked == [("disarm", ("force", True))]


async def test_taking_off_asks_for_a_height_and_refuses_words(feed):
    feed.snapshot = replace(FLYING, landed_state=1)
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("t")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("x", "enter")
        await until(pilot, lambda: "is not a number" in screen_text(app))
        await pilot.press("backspace", "backspace", "5", "enter")
        await until(pilot, lambda: feed.station.asked == [("take_off", 5.0)])


async def test_going_somewhere_is_asked_in_metres_about_home(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("g")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: feed.station.asked == [("go_to", 2.0, 1.0, 3.0)])


@pytest.mark.parametrize(("vtol", "words", "forward"), [(2, "Tip over", True), (1, "Leave", False)])
async def test_a_transition_asks_and_then_does_what_it_asked(feed, vtol, words, forward):
    feed.snapshot = replace(FLYING, vtol_state=vtol)
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("v")
        await until(pilot, lambda: words in screen_text(app) and "A mission is being flown" in screen_text(app))
        await pilot.press("n", "v")
        assert feed.station.asked == []
        feed.snapshot = replace(FLYING, vtol_state=7 - vtol)  # whatever it does meanwhile
        await pilot.press("y")
        await until(pilot, lambda: feed.station.asked == [("transition", ("forward", forward))])


@pytest.mark.parametrize(
    ("holder", "asks", "words", "asked"),
    [
        (0, 0, "Take control?", "take_control"),
        (245, 0, "Ask ground station 245", "take_control"),
        (255, 0, "Give control back?", "give_control_back"),
        (255, 245, "Let ground station 245", "share_control"),
    ],
)
async def test_control_is_taken_asked_for_shared_or_given_back(feed, holder, asks, words, asked):
    feed.snapshot = replace(FLYING, in_control=holder, asks_for_control=asks)
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("k")
        await until(pilot, lambda: words in screen_text(app))
        await pilot.press("n")
        assert feed.station.asked == []
        await pilot.press("k", "y")
        await until(pilot, lambda: feed.station.asked == [(asked,)])


async def test_a_speed_is_asked_for_with_its_kind(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("c")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: "Speed: '' is not a number" in screen_text(app))
        await pilot.press("1", "5", "tab", "2", "enter")
        await until(pilot, lambda: "or 1, over ground" in screen_text(app))
        await pilot.press("backspace", "1", "enter")
        await until(pilot, lambda: feed.station.asked == [("change_speed", 15.0, ("over_ground", True))])


async def test_leaving_a_running_mission_is_asked_about(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        for key in ("h", "l", "r"):
            await pilot.press(key)
            assert isinstance(app.screen, ConfirmScreen)
            await pilot.press("escape")
        assert feed.station.asked == []
        feed.snapshot = replace(FLYING, mission_state=4)
        await pilot.press("h")
        assert feed.station.asked == [("hold",)]


async def test_without_a_vehicle_nothing_is_sent(feed):
    feed.snapshot = EMPTY
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "waiting for a vehicle" in screen_text(app))
        await pilot.press("a", "t", "h", "l", "s")
        assert feed.station.asked == []


async def test_telemetry_goes_on_beneath_a_dialog(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("d")
        feed.snapshot = replace(FLYING, mode="LAND")
        below = next(screen for screen in app.screen_stack if isinstance(screen, FlyScreen))
        await until(pilot, lambda: below.snapshot.mode == "LAND")


@pytest.mark.parametrize("size", [(80, 24), (100, 30), (140, 45), (200, 60)])
async def test_what_matters_is_on_the_screen_at_every_size(feed, size):
    app = GroundStation(feed)
    async with app.run_test(size=size) as pilot:
        await until(pilot, lambda: "ARMED" in screen_text(app) and "172 W" in screen_text(app))
        text = screen_text(app)
        for words in (
            "ARMED",
            "HOLD",
            "HOVER LINEAR",
            "V 0.8",
            "687 rad/s",
            "nose +90°",
            "leave 100",
            "motor R",
            "172 W",
        ):
            assert words in text, words


@pytest.mark.parametrize("size", [(80, 24), (120, 36)])
async def test_forward_flight_is_on_the_screen_at_every_size(feed, size):
    feed.snapshot = ON_THE_WING
    app = GroundStation(feed)
    async with app.run_test(size=size) as pilot:
        await until(pilot, lambda: "in air, forward" in screen_text(app) and "54 W" in screen_text(app))
        text = screen_text(app)
        for words in (
            "FORWARD LINEAR",
            "V 12",
            "hover -- (50/100)  fwd 12 (20/60)",
            "leave 60",
            "nose +8°  bank +11°",
            "track  -1.7",
            "saturated: yaw, pitch",
            "to 3: forward -65 %, less energy ─",
        ):
            assert words in text, words


async def test_a_tall_screen_tells_the_whole_decision_the_air_and_the_energy_by_law(feed):
    feed.snapshot = ON_THE_WING
    app = GroundStation(feed)
    async with app.run_test(size=(140, 45)) as pilot:
        await until(pilot, lambda: "FORWARD  less energy" in screen_text(app))
        text = screen_text(app)
        for words in (
            "29.2 s     4983 J",
            "12.1 s     1757 J",
            "-59 %      -65 %",
            "leg to 3  100 m  climb +10 m",
            "along -1.2  across 0.5",
            "wnd     2.1 m/s 235° air 13.4",
            "est     2.2 m/s 243° air 13.2",
            "align                    110 J",
            "forward line-of-sight    600 J",
        ):
            assert words in text, words


async def test_a_small_screen_has_the_same_numbers_in_pages(feed):
    feed.snapshot = ON_THE_WING
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        seen = ""
        for page in (1, 2, 3, 4, 5):
            await until(pilot, lambda wanted=page: f"Flight {wanted}/5" in screen_text(app))
            seen += screen_text(app)
            await pilot.press("n")
        await until(pilot, lambda: "Flight 1/5" in screen_text(app))
        for words in ("pow      54 W", "est     2.2 m/s 243°", "to forward               900 J", "vs other     -59 %"):
            assert words in seen, words


async def test_a_screen_that_grows_counts_its_pages_anew_though_nothing_is_received(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "Flight 1/" in screen_text(app))
        await pilot.resize_terminal(140, 45)
        await until(pilot, lambda: app.screen.has_class("-tall") and "Flight ─" in screen_text(app))


async def test_the_view_is_named_and_follows_the_vtol_state(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        for vtol, named in ((3, True), (1, True), (4, False), (2, False), (3, True)):
            feed.snapshot = replace(FLYING, vtol_state=vtol)
            await until(pilot, lambda wanted=named: ("nose-up is level" in screen_text(app)) == wanted)
            assert ("tilt" in screen_text(app)) == named


async def test_a_saturated_axis_goes_after_a_second(feed):
    feed.snapshot = ON_THE_WING
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "saturated:" in screen_text(app))
        feed.snapshot = replace(ON_THE_WING, boot=61.2)
        await until(pilot, lambda: "saturated:" not in screen_text(app))
        assert "at limit: motor R" in screen_text(app)


async def test_an_impossible_way_is_called_so(feed):
    decision = ON_THE_WING.decision._replace(forward_time=math.inf, way=Way.HOVER, reason=DecisionReason.NO_TRIM)
    feed.snapshot = replace(ON_THE_WING, decision=decision)
    app = GroundStation(feed)
    async with app.run_test(size=(140, 45)) as pilot:
        await until(pilot, lambda: "impossible" in screen_text(app))
        assert "HOVER  no trim in transition" in screen_text(app)
        assert "to 3: hover, no trim in transition ─" in screen_text(app)


@pytest.mark.parametrize(("left", "shown"), [(0.94, False), (0.25, True), (0.05, True)])
async def test_a_battery_that_is_low_is_said_on_the_smallest_screen(feed, left, shown):
    feed.snapshot = replace(FLYING, battery=left)
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "ARMED" in screen_text(app))
        assert (f"battery {100 * left:.0f} %" in screen_text(app)) == shown


async def test_a_silent_vehicle_is_said_with_its_age(feed):
    feed.now = 104.0
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "LINK LOST" in screen_text(app))
        assert "silent for 4 s" in screen_text(app)


async def test_zooming_the_map_changes_its_scale_and_fits_again(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(140, 45)) as pilot:
        panel = app.screen.query_one(MapPanel)
        await until(pilot, lambda: panel.size and panel.snapshot is feed.snapshot)
        await pilot.press("plus")
        near = panel.scale
        await pilot.press("minus", "minus")
        assert panel.scale == 4 * near
        await pilot.press("0")
        assert panel.scale is None


async def test_help_lists_every_key(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(100, 40)) as pilot:
        await pilot.press("question_mark")
        assert isinstance(app.screen, HelpScreen)
        for words in ("Arm", "Take off", "Go to", "Transition", "speed", "Mission", "zoom"):
            await until(pilot, lambda wanted=words: wanted in screen_text(app))
        await pilot.press("escape")
        assert isinstance(app.screen, FlyScreen)


async def test_quitting_with_an_armed_vehicle_is_asked_about(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("q")
        assert isinstance(app.screen, ConfirmScreen)
        await pilot.press("y")
    assert app.return_value == 0


async def test_a_recording_pauses_seeks_and_cannot_be_commanded():
    feed = ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "square-flight.tlog")
    app = ReplayStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("space")
        assert not feed.playing
        await pilot.press("end")
        assert feed.snapshot.reached == {0, 1, 2, 3, 4, 5}
        assert len(feed.snapshot.track) > 50
        await pilot.press("home")
        assert feed.snapshot.reached == frozenset()
        await pilot.press("right_square_bracket")
        assert feed.speed == 2.0
        await pilot.press("a")
        assert isinstance(app.screen, FlyScreen)


def test_playing_past_damage_says_what_was_skipped():
    whole = (DATA / "square-flight.tlog").read_bytes()
    feed = ReplayFeed(TlogReader(whole[:100_000] + b"?" * 500 + whole[150_000:]), "damaged")
    feed.seek(0.0)
    for _ in range(400):
        feed.advance(0.01)
    assert any("bytes damaged" in line.text for line in feed.snapshot.messages)
    assert feed.snapshot.reached >= {4, 5}


async def test_a_taken_port_ends_the_app_with_its_reason():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        app = GroundStation(LiveFeed(Station(), "127.0.0.1", port, None))
        async with app.run_test(size=(80, 24)):
            pass
    assert f"127.0.0.1:{port}" in str(app.failure)
    assert app.return_value == LinkError.exit_code


def test_playing_and_seeking_reach_the_same_state():
    played = ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "x")
    played.seek(0.0)
    for _ in range(400):
        played.advance(0.01)
    sought = ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "x")
    sought.seek(4.0)
    fields = ("mode", "armed", "p", "q", "hybrid", "reached", "jumps", "energy", "mission", "landed_state", "v_history")
    for field in (*fields, "saturated_at", "parameters"):
        assert repr(getattr(played.snapshot, field)) == repr(getattr(sought.snapshot, field)), field
    assert not played.playing
    played.toggle()
    assert played.timeline.position == 0.0


@pytest.mark.parametrize("size", [(80, 24), (140, 45)])
@pytest.mark.parametrize(("flight", "power"), [(FLYING, "172 W"), (ON_THE_WING, "54 W")], ids=["hover", "forward"])
def test_the_flight_screen_looks_as_it_did(snap_compare, size, flight, power):
    feed = FakeFeed(note(flight, 99.0, 5, "Take-off complete: holding"))

    async def settle(pilot):
        narrow = size[0] < 120
        await until(pilot, lambda: pilot.app.screen.has_class("-narrow" if narrow else "-wide"))
        await until(pilot, lambda: power in screen_text(pilot.app))
        await settled(pilot)

    assert snap_compare(GroundStation(feed), terminal_size=size, run_before=settle)


async def test_a_long_message_is_shown_whole(feed):
    feed.snapshot = note(FLYING, 99.0, 4, "Go-to denied: 2000.0 m north is outside the arena 'open' (1500 m each way)")
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "each way)" in screen_text(app))
        assert "Go-to denied" in screen_text(app)
