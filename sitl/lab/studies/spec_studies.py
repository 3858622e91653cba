"""Studies that are shipped campaigns: their options are values of the campaign's file, their figures its summary."""

from __future__ import annotations

import argparse
import json
import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from protocol.names import FAILURE_UNITS
from sitl import TABLE, Navigation, Regime, SitlError
from sitl.defaults import GENTLE
from sitl.lab.campaigns.campaign_run import CampaignResult, run_specification
from sitl.lab.campaigns.campaign_summary import Drawn, passed, quantities, summary_lines
from sitl.lab.campaigns.chunks import ChunkStore
from sitl.lab.campaigns.engines import fly_here, on_processes
from sitl.lab.campaigns.specification import Specification, load_specification, shipped_values
from sitl.lab.studies.seeded_flights import DEFAULT_CRAFT, Craft, check_seeded, craft_of, write_json
from sitl.sensors.instruments import HEALTHY
from sitl.simulation.actuator_faults import ACTUATOR_FAILURES
from sitl.vehicle.injected_failures import BATTERY_FAILURES, FAILURE_NAMES, INSTRUMENT_UNITS

Changes = dict[str, Any]
NO_UNIT = "nothing"  # fails: whether a healthy flight raises an alarm
UNIT_NAMES = {  # by the words of the campaign's file
    "gyro": "gyroscope", "accel": "accelerometer", "mag": "magnetometer", "baro": "barometer", "gps": "gnss",
    "vio": "mocap", "airspeed": "pitot", "servo": "elevon",
}  # fmt: skip
PHASES = ["hover", "transition", "cruise", "back transition", "return"]
CHUNKS_A_JOB = 4  # at least, so that no process waits for another


class StudyOption(NamedTuple):
    """An option of a study."""

    name: str
    place: str  # in the campaign's file
    most: float
    is_limit: bool = False  # of a uniform distribution from 0 on; else it is the value


GUST_OPTION = StudyOption("gusts", "parameters.SIM_GUST_RMS", 10.0)
WINDS_OPTION = StudyOption("wind", "vary.wind.grid", 30.0)
GREATEST_WIND = StudyOption("wind", "vary.wind.uniform", 30.0, is_limit=True)
ERROR_OPTION = StudyOption("parameters", "vary.airframe.relative", 0.5)


def study_holds(args: argparse.Namespace) -> int:
    """Fly the holds; exit code 1 if one is farther off than it may be."""
    return fly_study(args, "holds", (WINDS_OPTION, GUST_OPTION, ERROR_OPTION))


def study_legs(args: argparse.Namespace) -> int:
    """Fly the legs; exit code 1 if one is not done or strays."""
    return fly_study(args, "legs", (WINDS_OPTION, GUST_OPTION, ERROR_OPTION))


def study_liveness(args: argparse.Namespace) -> int:
    """Fly from every law to every goal; exit code 1 if one is stuck."""
    options = (WINDS_OPTION._replace(most=15.0), ERROR_OPTION._replace(most=0.3))
    flying = [law for law in TABLE if law.regime is not Regime.GROUND]  # one that was added, too
    laws = {"vary.law.grid": [law.name for law in flying], "vary.law_number.grid": [int(law) for law in flying]}
    return fly_study(args, "liveness", options, laws)


def study_margins(args: argparse.Namespace) -> int:
    """Fly the map; exit code 1 if 40 ms, or 30 ms untold, are not survived at the specified noise."""
    given = [StudyOption("delay", "vary.delay.grid", 0.1), StudyOption("noise", "vary.noise.grid", 100.0)]
    changes: Changes = {"vehicle.told": False, "derived.survived": 0.03} if args.untold else {}
    if args.controller != "report":
        changes["vary.flown.grid"] = ["hover", "leg"]
    return fly_study(args, "delays", [option for option in given if getattr(args, option.name) is not None], changes)


def study_failures(args: argparse.Namespace) -> int:
    """Fly them; exit code 1 if one flew away, or a failure crashes in more than 1 of 20."""
    if args.nav == "truth":
        raise SitlError("--nav truth: a vehicle that sees the truth has no instruments to fail")
    changes = _failing(args, Navigation(args.nav))
    options = (GREATEST_WIND._replace(most=15.0), GUST_OPTION._replace(most=3.0), ERROR_OPTION._replace(most=0.3))
    return fly_study(args, "failures", options, changes)


def failing_pairs(navigation: Navigation) -> dict[str, list[tuple[str, str]]]:
    """Words of each unit aboard, by its name here, with each failure that it can have."""
    names = {unit: UNIT_NAMES.get(unit, unit) for unit in ("gyro", "accel", "mag", "baro", "gps", "vio", "airspeed")}
    known: dict[str, frozenset[int]] = {
        name: INSTRUMENT_UNITS[FAILURE_UNITS[unit]].failures
        for unit, name in names.items()
        if navigation in INSTRUMENT_UNITS[FAILURE_UNITS[unit]].navigation
    }
    known |= {"motor": ACTUATOR_FAILURES, "elevon": ACTUATOR_FAILURES, "battery": BATTERY_FAILURES}
    words = {name: unit for unit, name in UNIT_NAMES.items()}
    pairs = {
        name: [(words.get(name, name), FAILURE_NAMES[number]) for number in sorted(failures - {HEALTHY})]
        for name, failures in known.items()
    }
    return pairs | {NO_UNIT: [("battery", FAILURE_NAMES[HEALTHY])]}


def _failing(args: argparse.Namespace, navigation: Navigation) -> Changes:
    """The units, failures and phases that were asked for, of those that the vehicle has."""
    pairs = failing_pairs(navigation)
    units = _chosen("units", args.units, list(pairs)) if args.units else [name for name in pairs if name != NO_UNIT]
    known = [name for name in FAILURE_NAMES if name != FAILURE_NAMES[HEALTHY]]
    failures = _chosen("failures", args.failures, known)
    chosen = [pair for unit in units for pair in pairs[unit] if unit == NO_UNIT or pair[1] in failures]
    if not chosen:
        raise SitlError(f"--failures {' '.join(failures)}: {' and '.join(units)} cannot fail so")
    phases = _chosen("phases", args.phases, PHASES)
    return {
        "vary.unit.grid": [unit for unit, _ in chosen],
        "vary.failure.grid": [failure for _, failure in chosen],
        "vary.phase.grid": phases,
        "vary.phase_number.grid": [PHASES.index(phase) for phase in phases],
    }


def _chosen(option: str, asked: Sequence[str], known: Sequence[str]) -> list[str]:
    """The chosen among the known names; all of them by default.

    Raises:
        SitlError: There is no such thing.
    """
    for name in asked:
        if name not in known:
            raise SitlError(f"--{option} {name}: there are {', '.join(known)}")
    return list(asked or known)


def craft_changes(craft: Craft) -> Changes:
    """Values of a campaign's file that make it fly a craft."""
    changes: Changes = {"vehicle.navigation": craft.navigation.value, "vehicle.controller": craft.controller}
    for key, file in (("airframe", craft.airframe), ("sensors", craft.sensors)):
        if file is not None:
            changes[f"vehicle.{key}"] = str(Path(file).resolve()) if file.endswith(".toml") else file
    return changes if craft.pace == GENTLE else {**changes, "parameters.DRK_PACE": craft.pace}


USUAL = {**craft_changes(DEFAULT_CRAFT), "run.seed": 1}  # where a file says nothing


class FlownStudy(NamedTuple):
    """A study's cases, what was drawn of them, and the command that flies them."""

    result: CampaignResult
    drawn: Drawn
    command: str


def fly_study(
    args: argparse.Namespace,
    campaign: str,
    options: Sequence[StudyOption],
    changes: Mapping[str, Any] | None = None,
    then: Callable[[FlownStudy], None] | None = None,
) -> int:
    """Fly a study's campaign and print its summary.

    Args:
        args: Of the study.
        campaign: Its name.
        options: Of its options, those that are values of the file.
        changes: More values of the file, by their places.
        then: Called with the results.

    Returns:
        The exit code: 1 if the file requires what does not hold.

    Raises:
        SitlError: An argument is out of its bounds, or a file cannot be read or written.
    """
    check_seeded(args, {option.name: option.most for option in options})
    given = {option.place: _given(args, option) for option in options}
    flown = flown_study(args, campaign, {**craft_changes(craft_of(args)), **given, **(changes or {})})
    print("\n".join(summary_lines(*flown)), flush=True)
    if args.json is not None:
        write_json(args.json, case_rows(flown.result, flown.drawn))
    if then is not None:
        then(flown)
    return 0 if passed(flown.result, flown.drawn) else 1


def _given(args: argparse.Namespace, option: StudyOption) -> Any:  # noqa: ANN401 - a number or several
    value = getattr(args, option.name)
    return [0.0, value] if option.is_limit else value


def flown_study(args: argparse.Namespace, campaign: str, changes: Mapping[str, Any]) -> FlownStudy:
    """Fly so many cases of a campaign in each cell as flights are asked for, from the first seed on."""
    plain = load_specification(campaign, changes)
    cases = args.flights * plain.cells
    chunk = max(1, min(plain.chunk, cases // (CHUNKS_A_JOB * args.jobs)))
    counted = {"run.cases": cases, "run.seed": args.first}
    specification = load_specification(campaign, {**changes, **counted, "run.chunk": chunk})
    result = run_in_memory(specification, args.jobs)
    command = campaign_command(campaign, {**changes, "run.seed": args.first})
    return FlownStudy(result, quantities(specification, (one.number for one in result.flown)), command)


def campaign_command(campaign: str, changes: Mapping[str, Any]) -> str:
    """The command that flies a shipped campaign changed, with the values that differ from the file's."""
    file = shipped_values(campaign)
    words = [
        word
        for place, value in changes.items()
        if _value_at(file, place) != value
        for word in ("--set", f"{place}={value if isinstance(value, str) else json.dumps(value)}")
    ]
    return shlex.join(["darko-sitl", "campaign", campaign, *words])


def _value_at(tables: Mapping[str, Any], place: str) -> Any:  # noqa: ANN401 - of a file
    """A value of a file, or its default where the file has none."""
    found: Any = tables
    for key in place.split("."):
        found = found.get(key) if isinstance(found, dict) else None
    return USUAL.get(place) if found is None else found


def run_in_memory(specification: Specification, jobs: int) -> CampaignResult:
    """Fly a campaign and leave no folder."""
    engine = fly_here if jobs == 1 else on_processes(jobs)
    with TemporaryDirectory() as folder:
        return run_specification(specification, ChunkStore(Path(folder), specification), engine)


def case_rows(result: CampaignResult, drawn: Drawn) -> list[dict[str, object]]:
    """All cases, by names: seed, what was drawn and measured, end and error."""
    s = result.specification
    rows: list[dict[str, object]] = []
    for at, one in enumerate(result.flown):
        values = {name: column[at] for name, column in drawn.items()}
        judged = {
            name: value > 0.0 if measure.is_judgement else value
            for (name, measure), value in zip(s.measures.items(), one.measures, strict=True)
        }
        told = {"case": one.number, "seed": s.seed + one.number // s.cells}
        rows.append({**told, **values, **judged, "end": one.end, "error": one.error})
    return rows
