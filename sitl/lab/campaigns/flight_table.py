"""The flight of a campaign's file: vehicle, parameters, start, orders at their times, and its end."""

from __future__ import annotations

import ast
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

from protocol.names import FAILURE_TYPES, FAILURE_UNITS
from sitl import Law, Navigation
from sitl.defaults import STUDY_AIRFRAME
from sitl.lab.campaigns.number_expressions import (
    NUMBER_FUNCTIONS,
    TIME_NAME,
    NumberWalker,
    Value,
    is_judgement,
    parsed,
    unknown_name,
)
from sitl.lab.study_options import PAPARAZZI
from sitl.simulation.tuning import CONTROLLERS
from sitl.tools.toml_table import TomlTable
from sitl.vehicle.injected_failures import FAILURE_NAMES
from sitl.vehicle.parameters import PARAMETERS

LONGEST_FLIGHT = 3600.0  # [s]
AT_MISSION, AT_GROUND, AT_CRASH, AT_HOME = ENDS = ("mission", "ground", "crash", "home")  # of a flight
ORDER_KEYS = {  # of each order, beside its time
    "go to": {"to"}, "leg": {"to", "airspeed"}, "hold": set(), "land": set(), "return": set(),
    "mission": {"waypoints", "airspeed", "land"}, "enter": {"law"},
    "throw": {"velocity", "attitude", "rates", "axis", "rate"},
    "fail": {"unit", "failure", "instance"}, "set": {"parameters"},
}  # fmt: skip
ORDER_CONDITIONS = {"at", "do", "name", "if", "when", "latest"}  # keys that every order may have
WITHOUT_AUTOPILOT = {"go to", "leg", "enter", "throw", "fail", "set"}
LOOK_RATE = 50.0  # looks at a flight in a second, and samples of it
PERIODS_A_SECOND = 500  # control periods in a second
FAILURES = {**FAILURE_TYPES, **{name: number for number, name in enumerate(FAILURE_NAMES)}}
LAW_WORDS = [law.name for law in Law]
GREATEST_NUMBER = 1e9  # greatest number that is written


def is_condition(given: object) -> bool:
    """Whether something is an expression that is true or false."""
    return isinstance(given, str) and is_judgement(parsed(given))


class CampaignVehicle(NamedTuple):
    """The vehicle; a word or a number may be the name of what is drawn."""

    airframe: str
    navigation: Value
    sensors: str | None
    controller: Value
    latency: Value | None  # from inertial reading to actuator [s]; None: as specified
    told: bool  # whether it knows that latency
    noise: Value  # factor on all noise of the instruments
    arena: str
    autopilot: bool  # whether it flies; else the laws alone
    alone: Value  # 1: the hover law that begins flies alone, whatever comes of it


class CampaignStart(NamedTuple):
    """Place in the air where a flight begins, at rest; world NWU."""

    north: Value = 0.0  # [m]
    west: Value = 0.0  # [m]
    up: Value = 30.0  # [m]
    heading: Value = 0.0  # [rad]
    law: Value | None = None  # in force before the first order


class HomeCondition(NamedTuple):
    """Being at home: so near, so slow, for so long."""

    at: tuple[Value, ...]  # world NWU [m]
    radius: float  # [m]
    speed: float  # [m/s]
    seconds: float


class TimedOrder(NamedTuple):
    """An order, and the time or condition of its giving."""

    at: float  # [s], or from then on when a condition holds
    do: str  # of ORDER_KEYS
    told: dict[str, Any]  # numbers, words and lists of them
    name: str  # of its time, for measures; empty: none
    given_if: str  # condition of what is drawn; empty: always
    when: str  # condition of the flight; empty: at once
    latest: float  # it is given then whatever the condition [s]


class FlightTable(NamedTuple):
    """One flight, before its case is drawn."""

    vehicle: CampaignVehicle
    parameters: dict[str, Value]  # those with the time in their expression are set at every look
    start: CampaignStart
    seconds: float  # at most
    rate: float  # looks and samples in a second
    after_orders: Value  # at most so long after the last order [s]
    ends: tuple[str, ...]  # of ENDS, or conditions of the flight: the first that holds
    home: HomeCondition | None
    after: float  # flown on after the end [s]
    orders: tuple[TimedOrder, ...]

    @property
    def conditions(self) -> list[str]:
        """Conditions of the flight, for orders and for its end."""
        return [order.when for order in self.orders if order.when] + [end for end in self.ends if end not in ENDS]


class TableReader:
    """Reads numbers and words that may name what is drawn.

    Args:
        file: What errors call the file.
        names: Of what is drawn, each with its values.
    """

    def __init__(self, file: str, names: Mapping[str, tuple[Value, ...]]) -> None:
        self.file, self._names = file, names

    def over_time(self) -> TableReader:
        """A reader of expressions that may have the time, too."""
        return TableReader(self.file, {**self._names, TIME_NAME: (0.0,)})

    def table(self, given: object, where: str, known: set[str]) -> TomlTable:
        """A table of the file, its keys checked."""
        return TomlTable(self.file, given, where, known)

    def number(self, table: TomlTable, key: str, given: object) -> Value:
        """A number, or an expression of what is drawn."""
        if isinstance(given, str):
            self._check(table, key, given)
            return given
        if isinstance(given, bool) or not isinstance(given, int | float) or not abs(given) <= GREATEST_NUMBER:
            raise table.error(key, f"= {given!r} is neither a number nor an expression")
        return float(given)

    def numbers(self, table: TomlTable, key: str, given: object, count: int) -> tuple[Value, ...]:
        """Several of them."""
        if not isinstance(given, list) or len(given) != count:
            raise table.error(key, f"must be {count} numbers in brackets")
        return tuple(self.number(table, key, value) for value in given)

    def condition(self, table: TomlTable, key: str, given: object) -> str:
        """A condition of what is drawn."""
        if not isinstance(given, str) or not is_judgement(parsed(given)):
            raise table.error(key, f'= {given!r} is not a condition, such as "wind > 5"')
        self._check(table, key, given)
        return given

    def word(self, table: TomlTable, key: str, given: object, allowed: Collection[str]) -> str:
        """One of some words, or the name of what is drawn."""
        drawn = self._names[given] if isinstance(given, str) and given in self._names else (given,)
        for value in drawn:
            if value not in allowed:
                raise table.error(key, f"= {value!r} must be one of {', '.join(allowed)}, or what is drawn")
        return str(given)

    def _check(self, table: TomlTable, key: str, text: str) -> None:
        """Refuse an expression that has a name that is not drawn."""
        tried = dict.fromkeys((*self._names, "seed"), 1.0)
        for node in ast.walk(parsed(text)):
            if isinstance(node, ast.Name) and node.id not in {*tried, *NUMBER_FUNCTIONS, "pi", "g"}:
                raise table.error(key, f"= {text!r}: {unknown_name(node.id, self._names)}")
        try:
            NumberWalker(tried).number(text)
        except Exception as error:
            raise table.error(key, f"= {text!r}: {error}") from None


def flight_table(reader: TableReader, content: dict[str, Any]) -> FlightTable:
    """The flight as the file has it.

    Raises:
        SitlError: A key is not known, or a value not valid; the message says which.
    """
    keys = {"seconds", "after_orders", "rate", "until", "home", "after"}
    table = reader.table(content.get("flight", {}), "flight", keys)
    vehicle, seconds = _vehicle(reader, content.get("vehicle", {})), table.number("seconds", 0.02, LONGEST_FLIGHT)
    ends = content["flight"].get("until", [])
    if not isinstance(ends, list) or not all(end in ENDS or is_condition(end) for end in ends):
        raise table.error("until", f"must be some of {', '.join(ENDS)} and conditions in brackets")
    home = _home(reader, content["flight"]["home"]) if table.has("home") else None
    if (AT_HOME in ends) != (home is not None):
        raise table.error("home", 'and until = ["home"] belong together')
    if AT_MISSION in ends and not vehicle.autopilot:
        raise table.error("until", "= mission needs the autopilot")
    orders = [_order(reader, given, k, seconds) for k, given in enumerate(_listed(table, content, "order"))]
    rate = table.number("rate", 1.0, PERIODS_A_SECOND, LOOK_RATE)
    if PERIODS_A_SECOND % rate:
        raise table.error("rate", f"= {rate:g} does not divide {PERIODS_A_SECOND}")
    for number, order in enumerate(orders):
        if not vehicle.autopilot and order.do not in WITHOUT_AUTOPILOT:
            raise table.error("", f"order[{number}] = {order.do!r} needs the autopilot")
    return FlightTable(
        vehicle=vehicle,
        parameters=parameters_of(reader.over_time(), content.get("parameters", {}), "parameters"),
        start=_start(reader, content.get("start", {})),
        seconds=seconds,
        rate=rate,
        after_orders=reader.number(table, "after_orders", content["flight"].get("after_orders", LONGEST_FLIGHT)),
        ends=tuple(ends),
        home=home,
        after=table.number("after", 0.0, LONGEST_FLIGHT, 0.0),
        orders=tuple(sorted(orders, key=lambda order: order.at)),
    )


def _listed(table: TomlTable, content: dict[str, Any], key: str) -> list[Any]:
    given = content.get(key, [])
    if not isinstance(given, list):
        raise table.error("", f"needs orders written [[{key}]]")
    return given


def _vehicle(reader: TableReader, given: dict[str, Any]) -> CampaignVehicle:
    table = reader.table(given, "vehicle", set(CampaignVehicle._fields))
    return CampaignVehicle(
        airframe=table.text("airframe") if table.has("airframe") else STUDY_AIRFRAME,
        navigation=reader.word(table, "navigation", given.get("navigation", "sensors"), [n.value for n in Navigation]),
        sensors=table.text("sensors") if table.has("sensors") else None,
        controller=reader.word(table, "controller", given.get("controller", "hybrid"), [*CONTROLLERS, PAPARAZZI]),
        latency=reader.number(table, "latency", given["latency"]) if table.has("latency") else None,
        told=table.flag("told") if table.has("told") else True,
        noise=reader.number(table, "noise", given.get("noise", 1.0)),
        arena=table.text("arena") if table.has("arena") else "open",
        autopilot=table.flag("autopilot") if table.has("autopilot") else True,
        alone=reader.number(table, "alone", given.get("alone", 0.0)),
    )


def _start(reader: TableReader, given: dict[str, Any]) -> CampaignStart:
    table = reader.table(given, "start", set(CampaignStart._fields))
    law = reader.word(table, "law", given["law"], LAW_WORDS) if table.has("law") else None
    numbers = {key: reader.number(table, key, given[key]) for key in ("north", "west", "up", "heading") if key in given}
    return CampaignStart(law=law, **numbers)


def _home(reader: TableReader, given: Any) -> HomeCondition:  # noqa: ANN401 - of the file
    table = reader.table(given, "flight.home", set(HomeCondition._fields))
    at = reader.numbers(table, "at", table.table("at"), 3)
    return HomeCondition(at, *(table.number(key, 0.01, 1e4) for key in ("radius", "speed", "seconds")))


def parameters_of(reader: TableReader, given: Any, where: str) -> dict[str, Value]:  # noqa: ANN401 - of the file
    """Parameters of the vehicle by their names, in the units of the wire's table.

    Raises:
        SitlError: A parameter is not known, or a value not valid.
    """
    table = reader.table(given, where, set(PARAMETERS))
    return {name: reader.number(table, name, value) for name, value in given.items()}


def _order(reader: TableReader, given: Any, number: int, seconds: float) -> TimedOrder:  # noqa: ANN401 - of the file
    where = f"order[{number}]"
    do = reader.table(given, where, set(given) if isinstance(given, dict) else set()).choice("do", list(ORDER_KEYS))
    table = reader.table(given, where, ORDER_CONDITIONS | ORDER_KEYS[do])
    told: dict[str, Any] = {}
    for key in ORDER_KEYS[do] & set(given):
        told[key] = _told(reader, table, key, given[key])
    for key in {"to", "unit", "law", "failure", "parameters"} & ORDER_KEYS[do]:
        table.table(key)  # which is missing else
    if do == "mission" and not told.keys() & {"waypoints", "land"}:
        raise table.error("waypoints", "are missing")
    at = table.number("at", 0.0, seconds, 0.0)
    if table.has("when") and not is_condition(given["when"]):
        raise table.error("when", f"= {given['when']!r} is not a condition, such as \"regime == 'FORWARD'\"")
    return TimedOrder(
        at=at,
        do=do,
        told=told,
        name=table.text("name") if table.has("name") else "",
        given_if=reader.condition(table, "if", given["if"]) if table.has("if") else "",
        when=table.text("when") if table.has("when") else "",
        latest=table.number("latest", at, LONGEST_FLIGHT, LONGEST_FLIGHT),
    )


def _told(reader: TableReader, table: TomlTable, key: str, given: Any) -> Any:  # noqa: ANN401 - of the file
    match key:
        case "to" | "velocity" | "rates" | "axis" | "land":
            return reader.numbers(table, key, given, 3)
        case "attitude":
            return reader.numbers(table, key, given, 4)
        case "waypoints":
            if not isinstance(given, list) or not given:
                raise table.error(key, "must be lines of north, west, up [m] and the time to stay [s]")
            return [reader.numbers(table, key, line, 4) for line in given]
        case "law":
            return reader.word(table, key, given, LAW_WORDS)
        case "unit":
            return reader.word(table, key, given, FAILURE_UNITS)
        case "failure":
            return reader.word(table, key, given, list(FAILURES))
        case "parameters":
            return parameters_of(reader, given, "order.parameters")
    return reader.number(table, key, given)
