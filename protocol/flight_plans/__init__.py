"""Flight plans of the Paparazzi project: the language and its files, without anything that flies.

A plan is blocks of stages with exceptions between them, over named waypoints and sectors. ``load_flight_plan`` reads
one and the procedures it includes; expressions stay trees until ``evaluation`` is given a table of names.
"""

from protocol.flight_plans.flight_plan import FlightPlan
from protocol.flight_plans.plan_loader import load_flight_plan, read_flight_plan, shipped_plan_names
from protocol.flight_plans.plan_package import render_flight_plan
from protocol.flight_plans.xml_elements import FlightPlanError

__all__ = [
    "FlightPlan",
    "FlightPlanError",
    "load_flight_plan",
    "read_flight_plan",
    "render_flight_plan",
    "shipped_plan_names",
]
