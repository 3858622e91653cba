"""``darko-sitl``: the vehicle process and what can be run with the vehicle alone."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from protocol.tools.command_line import run_cli
from sitl.errors import SitlError

STUDIES = {  # in sitl/commands/study_commands
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
}
COMMANDS = {
    "run": "fly the vehicle over MAVLink (what darko-sitl does when no command is named)",
    "mocap": "serve the running vehicle's pose by NatNet, as the Motive of a motion-capture hall does",
    "scenario": "fly an experiment of the report or before a wind wall, print its figures and save its plot",
    "report": "run every experiment of the report and write one HTML page with verdicts",
    **STUDIES,
    "hybrid": "solve a textbook hybrid system, or print the diagram of the vehicle's supervisor",
    "identify": "estimate an airframe's parameters from a recorded flight, with intervals, or fly one that tells them",
    "plan": "check a flight plan: what is flown, what is refused, and the nearest mission",
    "day": "fly a day under the net from one file, headless: plan, wind, failures, operator; and write a page about it",
    "airframe": "list the parameter sets, or show one with units and sources",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command of ``sitl.commands``; returns the exit code."""
    return run_cli("sitl", "darko-sitl", COMMANDS, SitlError, argv, dict.fromkeys(STUDIES, "study_commands"))


if __name__ == "__main__":
    sys.exit(main())
