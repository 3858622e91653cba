"""The dialog that has something fail on the vehicle: what, how, which of two, and once more whether it shall."""

from __future__ import annotations

from typing import NamedTuple

from textual.app import App

from darko_gcs.feed.feed import Feed
from darko_gcs.state.lasting_faults import HEALED, INJECTED
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import RESTARTED
from darko_gcs.station.station import Station
from darko_gcs.tui.flight_dialogs import Send, named
from darko_gcs.tui.screens.dialogs import ChooseScreen, confirm
from protocol.names import FAILURE_TYPES, FAILURE_UNITS

ENABLING = "SYS_FAILURE_EN"  # the parameter, as PX4 calls it
POLL_TIME, MAX_POLLS = 0.1, 10  # between looks whether its value has come [s], and how many looks
UNIT_WORDS = {  # as the vehicle's own messages say
    "gyro": "gyroscope", "accel": "accelerometer", "mag": "magnetometer", "baro": "barometer", "gps": "GNSS",
    "vio": "motion capture", "airspeed": "pitot tube", "servo": "elevon", "rc_signal": "radio control",
    "mavlink_signal": "link",
}  # fmt: skip
FAILURE_WORDS = {
    "ok": "end the failure", "off": "says or does nothing", "stuck": "stays as it is", "garbage": "at random",
    "wrong": "is wrong (SIM_FAIL_WRONG, SIM_FAIL_SIZE)", "slow": "follows or reports slowly",
    "delayed": "is late", "intermittent": "comes and goes",
}  # fmt: skip
MISSING = frozenset({"optical_flow", "distance_sensor", "avoidance", "rc_signal"})  # on DarkO
PAIRS = frozenset({"motor", "servo"})
PAIRS_SAID = frozenset({"motor", "elevon"})  # the same in the vehicle's messages
LINK = "mavlink_signal"  # which a vehicle cannot be told to mend: it is off for SIM_LINK_OFF_T
DURATIONS = {"until it is ended": 0.0, "2 s": 2.0, "5 s": 5.0, "15 s": 15.0, "60 s": 60.0}  # [s]; 0: nothing ends it
WHICH = ("all", "1 (left)", "2 (right)")  # instances, by number


def failing_now(s: Snapshot) -> dict[str, str]:
    """Failures and their kinds, by the vehicle's own messages since it started: {"GNSS": "off", "motor 1": "stuck"}."""
    found: dict[str, str] = {}
    for line in s.log.lines:
        if line.text.lower().startswith(RESTARTED.lower()):
            found.clear()
        elif injected := INJECTED.match(line.text):
            found |= dict.fromkeys(_each(injected["unit"]), injected["how"])
        elif healed := HEALED.match(line.text):
            for name in _each(healed["unit"]):
                found.pop(name, None)
    return found


def _each(name: str) -> list[str]:
    """Each of a pair that has its plural, "motors"; else the name."""
    one = name.removesuffix("s")
    return [f"{one} {number}" for number in (1, 2)] if name != one and one in PAIRS_SAID else [name]


def ask_failure(app: App[int], feed: Feed, request: Send) -> None:
    """Ask what shall fail and how; ask again, then inject it. Where the vehicle would refuse, first offer its leave."""
    if ENABLING in feed.snapshot.parameters.values:
        _ask_leave(app, feed, request)
        return
    screen, polls = app.screen, iter(range(MAX_POLLS))

    def look() -> None:
        if app.screen is not screen:
            timer.stop()  # the operator has gone on to something else
        elif ENABLING in feed.snapshot.parameters.values or next(polls, None) is None:
            timer.stop()  # a vehicle that does not answer has no such parameter: it judges by itself
            _ask_leave(app, feed, request)

    request(lambda station, now: station.fetch_parameter(ENABLING, now))
    timer = app.set_interval(POLL_TIME, look)


def _ask_leave(app: App[int], feed: Feed, request: Send) -> None:
    """Have the vehicle take failures if it does not yet, then choose one."""
    if feed.snapshot.parameters.values.get(ENABLING) != 0.0:
        _choose(app, feed, request)
        return

    def enable() -> None:
        request(lambda station, now: station.set_parameter(ENABLING, 1.0, now))
        _choose(app, feed, request)

    confirm(app, named(feed, f"The vehicle takes no failures while {ENABLING} is 0. Set it to 1?"), enable)


def _choose(app: App[int], feed: Feed, request: Send) -> None:
    """Choose what fails, how, and which of several."""
    is_ours = feed.snapshot.is_darko
    units = [unit for unit in FAILURE_UNITS if not (is_ours and unit in MISSING)]
    failures = [*(failure for failure in FAILURE_TYPES if failure != "ok"), "ok"]  # the first one is chosen soonest
    ways = [f"{failure:<14}{FAILURE_WORDS.get(failure, '')}".rstrip() for failure in failures]

    def unit_chosen(number: int | None) -> None:
        if number is not None:
            title = f"{_words(units[number])}: how does it fail?"
            app.push_screen(ChooseScreen(title, ways), lambda failure: failure_chosen(units[number], failure))

    def failure_chosen(unit: str, failure: int | None) -> None:
        if failure is None:
            return
        if unit in PAIRS:
            app.push_screen(ChooseScreen("Which one?", WHICH), lambda which: chosen(unit, failures[failure], which))
        else:
            chosen(unit, failures[failure], 0)

    def chosen(unit: str, failure: str, which: int | None) -> None:
        if which is not None:
            _ask_duration(app, feed, request, _Wanted(unit, failure, which))

    failing = ", ".join(f"{name} {failure}" for name, failure in failing_now(feed.snapshot).items())
    title = "What shall fail?" + (f" Failing now: {failing}" if failing else "")
    app.push_screen(ChooseScreen(named(feed, title), [_words(unit) for unit in units]), unit_chosen)


class _Wanted(NamedTuple):
    """A failure that was chosen: names of unit and kind, and which of a pair."""

    unit: str
    failure: str
    which: int

    def fields(self, failure: str) -> dict[str, int]:
        """The fields of the command for it, or for another kind of failure of the same unit."""
        return {"unit": FAILURE_UNITS[self.unit], "failure": FAILURE_TYPES[failure], "instance": self.which}


def _ask_duration(app: App[int], feed: Feed, request: Send, wanted: _Wanted) -> None:
    """Choose how long it fails, where that is to be chosen."""

    def chosen(number: int | None) -> None:
        if number is not None:
            _ask_sure(app, feed, request, wanted, list(DURATIONS)[number])

    if wanted.failure == "ok" or wanted.unit == LINK:
        chosen(0)
    else:
        app.push_screen(ChooseScreen("For how long? This station ends it then", list(DURATIONS)), chosen)


def _ask_sure(app: App[int], feed: Feed, request: Send, wanted: _Wanted, duration: str) -> None:
    """Ask once more, inject it, and end it after its time."""
    one, seconds = f", {WHICH[wanted.which]}" if wanted.unit in PAIRS else "", DURATIONS[duration]
    span = f", for {duration}" if seconds else ""
    flying = " IT IS IN THE AIR." if feed.snapshot.status.is_airborne else ""
    question = f"Have the {_words(wanted.unit)} fail: {wanted.failure}{one}{span}?{flying}"
    if wanted.failure == "ok":
        question = f"End the failure of the {_words(wanted.unit)}{one}?"

    def inject(station: Station, now: float) -> None:
        station.inject_failure(now, **wanted.fields(wanted.failure))
        if seconds:  # of this vehicle, whichever is shown then
            app.set_timer(seconds, lambda: station.inject_failure(feed.now, **wanted.fields("ok")))

    confirm(app, named(feed, question), lambda: request(inject))


def _words(unit: str) -> str:
    return UNIT_WORDS.get(unit, unit.replace("_", " "))
