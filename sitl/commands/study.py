"""``darko-sitl study``: the laboratory's measurements."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from importlib import import_module
from typing import NamedTuple

from protocol.tools.command_line import CommandParser
from sitl.commands.airframe import tell_warnings
from sitl.lab import study_options


class Study(NamedTuple):
    """A study: the module of the laboratory that has its ``study_NAME``, and a line about it."""

    module: str
    text: str


STUDIES = {
    "campaign": Study(
        "studies.campaign",
        "fly a square forward from many seeds, in wind and gusts with a wrong model, and print statistics",
    ),
    "falls": Study(
        "studies.falls",
        "throw the vehicle into any attitude: height lost, how the falls end, and a map of the height needed",
    ),
    "landings": Study(
        "studies.landings",
        "land from many seeds in wind and gusts: upright, tipped over or crashed, and how long it bounces",
    ),
    "holds": Study(
        "studies.spec_studies", "hold a point in wind and gusts from many seeds, and print how far off the vehicle was"
    ),
    "legs": Study(
        "studies.spec_studies",
        "hold, fly a leg and hold again in strong wind from many seeds, and print how the flights end",
    ),
    "liveness": Study(
        "studies.spec_studies",
        "fly from every law to every kind of goal in steady winds, and print which law holds the vehicle short of it",
    ),
    "containment": Study(
        "studies.containment",
        "fly at random under a net, in calm and before a wind wall, and print how near it the vehicle came",
    ),
    "jet": Study(
        "studies.jet_holds",
        "hold a point in a wind wall's jet over wind and gust, and print and draw a map of how far off it was",
    ),
    "staircase": Study(
        "studies.staircase",
        "fly the staircase of winds that DarkO flew before a wind wall, by each controller, beside that flight",
    ),
    "claims": Study(
        "studies.claims",
        "try what the author of the law that flew says of it: winds in which it is stable, gusts that it rejects",
    ),
    "margins": Study(
        "studies.spec_studies",
        "fly with delays and noise added: which laws converge, how exactly, and how busy the elevons are",
    ),
    "loops": Study(
        "studies.loop_margins",
        "open each loop at the actuators, and print how much gain, phase and delay the law in force bears there",
    ),
    "consistency": Study(
        "studies.consistency", "compare the navigation filter's errors with what it says of them, over many seeds"
    ),
    "failures": Study(
        "studies.spec_studies",
        "let instruments, actuators and battery fail in hover, transition and cruise, and print how it ends",
    ),
    "region": Study(
        "studies.hover_region", "prove and fly the region of attraction of the linear hover law, and compare gains"
    ),
    "winds": Study(
        "studies.hover_winds",
        "fly recoveries in winds, and print whether the proved V of the linear hover law holds them",
    ),
    "breakeven": Study(
        "studies.break_even", "hover or fly: the distance from which forward flight costs less, predicted and flown"
    ),
    "regret": Study(
        "studies.choice_regret",
        "fly random legs in the hover and forward, and print what the vehicle's choice cost over the better way",
    ),
    "scenario": Study(
        "reproduction.experiments.experiment_list",
        "fly an experiment of the report or before a wind wall, print its figures and save its plot",
    ),
    "report": Study(
        "reproduction.experiments.experiment_list",
        "run every experiment of the report and write one HTML page with verdicts",
    ),
    "validate": Study(
        "validation.validation_page",
        "put the simulator beside the real aircraft's flight and its authors' curves, on one HTML page with verdicts",
    ),
    "hybrid": Study(
        "reproduction.hybrid_systems",
        "solve a textbook hybrid system, or print the diagram of the vehicle's supervisor",
    ),
    "identify": Study(
        "identification.identification_study",
        "estimate an airframe's parameters from a recorded flight, with intervals, or fly one that tells them",
    ),
}


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl study``."""
    options = CommandParser(prog="darko-sitl study", description=commands["study"] + ".")
    subcommands = options.add_subparsers(dest="subcommand", required=True, metavar="STUDY", title="studies")
    for name, (_, text) in STUDIES.items():
        add_arguments = getattr(study_options, name)
        add_arguments(subcommands.add_parser(name, help=text, description=text + "."))
    return options


def run(args: argparse.Namespace) -> int:
    """Run the study."""
    tell_warnings(getattr(args, "airframe", None))
    module = import_module(f"sitl.lab.{STUDIES[args.subcommand].module}")
    return int(getattr(module, f"study_{args.subcommand}")(args))
