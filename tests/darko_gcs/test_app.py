"""The screens, driven by keys on a feed that needs no network."""

import math
import socket
from dataclasses import replace

import pytest
from textual.widgets import Input, OptionList

from darko_gcs.app import GroundStation
from darko_gcs.errors import LinkError
from darko_gcs.feed import LiveFeed, ReplayFeed
from darko_gcs.replay_app import ReplayStation
from darko_gcs.screens.dialogs import ConfirmScreen, HelpScreen
from darko_gcs.screens.fly import FlyScreen
from darko_gcs.screens.mission import Draft, MissionScreen
from darko_gcs.snapshot import EMPTY, Actuators, Air, Decision, Energy, Hybrid, Jump, Navigation
from darko_gcs.station import Station
from darko_gcs.store import note
from darko_gcs.widgets.map import MapPanel
from protocol.frames import Geodetic, quaternion_from_euler
from protocol.plans import load
from protocol.tlog import TlogReader, read_tlog
from tests.support.paths import DATA

HOVER = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
FLYING = replace(
    EMPTY,
    source=(1, 1), autopilot=12, kind=19, armed=True, mode="HOLD", heartbeat_at=100.0, landed_state=2, boot=60.0,
    q=HOVER, repr_offset=(math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0), heading=0.0, p=(2.0, 1.0, -3.0),
    v=(0.5, 0.0, 0.0), target=(4.0, 0.0, -3.0), home=Geodetic(43.5648, 1.4811, 150.0), airspeed=0.5,
    wind=(0.0, 2.0, 0.0),
    hybrid=Hybrid(60.0, 1, 2, 0.8, math.nan, 50.0, 100.0, 0.0, 2, 1), law_since=48.0,
    v_history=tuple((float(t), 10.0 ** (2 - t / 20), math.nan) for t in range(61)),
    jumps=(Jump(48.0, 2, 2, 1, 1, "enter_linear", 49.9),),
    actuators=Actuators(
        (687.0, 1000.0), (690.0, 1000.0), (2.4, 5.1), (0.1, -0.5), (0.1, -0.5), 200.0, 1000.0, 0.5236, 10
    ),
    energy=Energy(172.0, 5513.0, (8.0, 5505.0, 0.0)), voltage=12.4, battery=0.94, prearm_ok=True,
    track=tuple((0.1 * n, 0.05 * n) for n in range(20)), mission=load(DATA / "square.plan").items,
    mission_count=6, mission_current=2, mission_state=3, reached=frozenset({0, 1}), received=100, rate=146.0,
)  # fmt: skip

ON_THE_WING = replace(
    FLYING,
    mode="MISSION", vtol_state=4, q=quaternion_from_euler(0.2, 0.14, 0.5), heading=0.5, v=(12.0, 6.0, -1.0),
    airspeed=13.5, navigation=Navigation(-1.7, 0.3, 42.0, 0.4), air=Air((1.0, 2.0, 0.0), (1.2, 1.7, 0.1), 13.2, 13.4),
    hybrid=Hybrid(60.0, 6, 5, math.nan, 12.3, 20.0, 60.0, 0.0, 5, 1), hover_limits=(50.0, 100.0),
    forward_limits=(20.0, 60.0),
    v_history=tuple(
        (float(t), 10.0 ** (2 - t / 20) if t < 40 else math.nan, 80.0 - t if t > 35 else math.nan) for t in range(61)
    ),
    decision=Decision(59.0, 3, 2, 1, 100.0, 10.0, -1.2, 0.5, 29.2, 4983.0, 12.1, 1757.0),
    given_up_at=(-math.inf, 59.5, 60.0, 58.0, -math.inf),
    energy=Energy(54.0, 3920.0, (8.0, 1500.0, 300.0, 110.0, 900.0, 600.0, 502.0, 0.0, 0.0)),
)  # fmt: skip


class FakeStation:
    """Remembers what it was asked."""

    def __init__(self, snapshot):
        self.snapshot, self.asked = snapshot, []

    def __getattr__(self, name):
        return lambda *args, **kwargs: self.asked.append((name, *args[:-1], *kwargs.items()))


class FakeFeed:
    """A feed that stands still."""

    def __init__(self, snapshot):
        self.snapshot, self.now = snapshot, 100.5
        self.station = FakeStation(snapshot)
        self.closed = False

    async def open(self):
        pass

    async def close(self):
        self.closed = True

    def advance(self, elapsed):
        pass


async def until(pilot, holds):
    """Wait for something to hold, however busy the machine is; give up after many turns."""
    for _ in range(200):
        if holds():
            return
        await pilot.pause(0.05)
    assert holds()


def screen_text(app):
    """What stands on the screen."""
    width, height = app.size
    lines = app.screen._compositor.render_strips()
    return "\n".join("".join(segment.text for segment in strip)[:width] for strip in lines[:height])


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


@pytest.mark.parametrize(
    ("vtol", "words", "forward"),
    [(3, "Tip over", True), (2, "Tip over", True), (4, "Leave", False), (1, "Leave", False)],
)
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


@pytest.mark.parametrize("size", [(80, 24), (100, 40), (120, 36), (140, 45)])
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
            "gave up: yaw, pitch",
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


async def test_the_view_is_named_and_follows_the_vtol_state(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        for vtol, named in ((3, True), (1, True), (4, False), (2, False), (3, True)):
            feed.snapshot = replace(FLYING, vtol_state=vtol)
            await until(pilot, lambda wanted=named: ("nose-up is level" in screen_text(app)) == wanted)
            assert ("tilt" in screen_text(app)) == named


async def test_what_was_given_up_goes_after_a_second(feed):
    feed.snapshot = ON_THE_WING
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "gave up" in screen_text(app))
        feed.snapshot = replace(ON_THE_WING, boot=61.2)
        await until(pilot, lambda: "gave up" not in screen_text(app))
        assert "at limit: motor R" in screen_text(app)


async def test_an_impossible_way_is_called_so(feed):
    feed.snapshot = replace(ON_THE_WING, decision=ON_THE_WING.decision._replace(forward_time=math.inf, way=1, reason=6))
    app = GroundStation(feed)
    async with app.run_test(size=(140, 45)) as pilot:
        await until(pilot, lambda: "impossible" in screen_text(app))
        assert "HOVER  no trim in transition" in screen_text(app)
        assert "to 3: hover, no trim in transition ─" in screen_text(app)


async def test_a_silent_vehicle_is_said_with_its_age(feed):
    feed.now = 104.0
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "LINK LOST" in screen_text(app))
        assert "silent for 4 s" in screen_text(app)


async def test_zooming_the_map_changes_its_scale_and_fits_again(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(140, 45)) as pilot:
        await pilot.pause(0.2)
        panel = app.screen.query_one(MapPanel)
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


async def test_a_mission_is_opened_edited_saved_and_uploaded(feed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.plan").write_bytes((DATA / "square.plan").read_bytes())
    feed.snapshot = feed.station.snapshot = replace(FLYING, mission=())
    app = GroundStation(feed)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("m")
        screen = app.screen
        assert isinstance(screen, MissionScreen)
        await pilot.press("o")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: len(screen.draft.plan.items) == 6 and app.screen is screen)
        await pilot.press("down", "x")
        assert len(screen.draft.plan.items) == 5
        await pilot.press("i")
        await until(pilot, lambda: isinstance(app.focused, OptionList))
        await pilot.press("enter")
        await until(pilot, lambda: len(screen.draft.plan.items) == 6 and app.screen is screen)
        await pilot.press("shift+down", "u")
        await until(pilot, lambda: feed.station.asked == [("upload", screen.draft.plan.items)])
        await pilot.press("w")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: app.screen is screen)
        assert load(tmp_path / "a.plan").items == screen.draft.plan.items


async def test_a_bad_edit_is_refused_with_the_fields_name(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(100, 40)) as pilot:
        await pilot.press("m")
        screen = app.screen
        await until(pilot, lambda: len(screen.draft.plan.items) == 6)
        before = screen.draft.plan.items
        await pilot.press("e")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("x", "enter")
        await until(pilot, lambda: "'x' is neither a MAV_CMD nor its number" in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is screen)
        assert screen.draft.plan.items == before


async def test_a_parameter_is_edited_in_its_own_field(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        screen = app.screen
        await until(pilot, lambda: len(screen.draft.plan.items) == 6)
        await pilot.press("down", "e")
        await until(pilot, lambda: isinstance(app.focused, Input) and "Pass radius [m]" in screen_text(app))
        await pilot.press("tab", "tab", "tab", "tab", "8", "enter")
        await until(pilot, lambda: screen.draft.plan.items[1].params[2] == 8.0)
        await until(pilot, lambda: "pass 8" in screen_text(app))


async def test_another_command_opens_its_own_fields(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        screen = app.screen
        await until(pilot, lambda: len(screen.draft.plan.items) == 6)
        await pilot.press("down", "e")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press(*"18", "enter")
        await until(pilot, lambda: "Item 1: Loiter for turns" in screen_text(app))
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("tab", "tab", "3", "enter")
        await until(pilot, lambda: screen.draft.plan.items[1].params[:3] == (3.0, 0.0, 30.0))


async def test_an_unsent_plan_is_kept_when_its_screen_is_closed(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6)
        await pilot.press("x", "escape")
        await until(pilot, lambda: "The plan is not on the" in screen_text(app))
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.table.row_count == 5)
        assert len(app.draft.plan.items) == 5
        await until(pilot, lambda: "not on the vehicle, not saved" in screen_text(app))


async def test_nothing_replaces_an_unsent_plan_without_asking(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6)
        await pilot.press("x")
        for key in ("f", "o", "q"):
            await pilot.press(key)
            await until(pilot, lambda: isinstance(app.screen, ConfirmScreen))
            await pilot.press("n")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        assert feed.station.asked == []
        assert len(app.draft.plan.items) == 5
        await pilot.press("f", "y")
        await until(pilot, lambda: feed.station.asked == [("download",)])


async def test_a_plan_that_the_vehicle_took_is_at_no_risk(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6)
        await pilot.press("x", "u")
        assert app.draft.is_at_risk
        feed.snapshot = replace(FLYING, mission=app.draft.plan.items)
        await until(pilot, lambda: not app.draft.is_at_risk)


async def test_a_snapshot_that_comes_before_the_table_has_columns_is_not_lost(feed):
    class Early(MissionScreen):
        def compose(self):
            self.snapshot = FLYING  # as the app's pull may do, in any turn between push and mount
            yield from super().compose()

    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)):
        app.pull = lambda: None
        screen = Early(feed.station, lambda: 0.0, Draft())
        await app.push_screen(screen)
        assert screen.draft.plan.items == FLYING.mission
        assert [screen.table.get_cell_at((row, 0)) for row in range(3)] == ["✓", "✓", "▶"]


async def test_an_unreadable_file_is_said_by_name(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("m", "o")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("ctrl+u", *"nowhere.plan", "enter")
        await until(pilot, lambda: "nowhere.plan" in screen_text(app) and "No such file" in screen_text(app))


async def test_a_mission_is_followed_in_the_table(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6 and app.screen.snapshot.reached)
        marks = [app.screen.table.get_cell_at((row, 0)) for row in range(6)]
        assert marks == ["✓", "✓", "▶", " ", " ", " "]


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
    for field in ("mode", "armed", "p", "q", "hybrid", "reached", "jumps", "energy", "mission", "landed_state"):
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
        await pilot.pause(0.3)

    assert snap_compare(GroundStation(feed), terminal_size=size, run_before=settle)


async def test_a_long_message_is_shown_whole(feed):
    feed.snapshot = note(FLYING, 99.0, 4, "Go-to denied: 2000.0 m north is outside the arena 'open' (1500 m each way)")
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "each way)" in screen_text(app))
        assert "Go-to denied" in screen_text(app)
