"""``darko-sitl study``: the laboratory's measurements, one of ``study_commands`` each."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from importlib import import_module

from protocol.tools.command_line import CommandParser
from sitl.commands import study_options

STUDIES = {
    "campaign": "fly a square forward from many seeds, in wind and gusts with a wrong model, and print statistics",
    "falls": "throw the vehicle into any attitude: height lost, how the falls end, and a map of the height needed",
    "landings": "land from many seeds in wind and gusts: upright, tipped over or crashed, and how long it bounces",
    "holds": "hold a point in wind and gusts from many seeds, and print how far off the vehicle was",
    "containment": "fly at random under a net, in calm and before a wind wall, and print how near it the vehicle came",
    "jet": "hold a point in a wind wall's jet over wind and gust, and print and draw a map of how far off it was",
    "margins": "fly with delays and noise added: which laws converge, how exactly, and how busy the elevons are",
    "consistency": "compare the navigation filter's errors with what it says of them, over many seeds",
    "failures": "let instruments, actuators and battery fail in hover, transition and cruise, and print how it ends",
    "region": "prove and fly the region of attraction of the linear hover law, and compare gains",
    "breakeven": "hover or fly: the distance from which forward flight costs less, predicted and flown",
    "scenario": "fly an experiment of the report or before a wind wall, print its figures and save its plot",
    "report": "run every experiment of the report and write one HTML page with verdicts",
    "hybrid": "solve a textbook hybrid system, or print the diagram of the vehicle's supervisor",
    "identify": "estimate an airframe's parameters from a recorded flight, with intervals, or fly one that tells them",
}


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl study``."""
    options = CommandParser(prog="darko-sitl study", description=commands["study"] + ".")
    subcommands = options.add_subparsers(dest="subcommand", required=True, metavar="STUDY", title="studies")
    for name, text in STUDIES.items():
        add_arguments = getattr(study_options, name)
        add_arguments(subcommands.add_parser(name, help=text, description=text + "."))
    return options


def run(args: argparse.Namespace) -> int:
    """Run the study."""
    return int(import_module(f"sitl.commands.study_commands.{args.subcommand}").run(args))
