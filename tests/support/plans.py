"""Flight plans for tests: ours, short ones made of a few elements, and public ones where they are there."""

import os
from pathlib import Path

from protocol.flight_plans import read_flight_plan
from protocol.flight_plans.plan_loader import SHIPPED_PLANS
from protocol.flight_plans.xml_elements import Place, SourceText
from tests.support.paths import DATA

OUR_PLANS = DATA / "flight_plans"
VOLIERE = SHIPPED_PLANS / "voliere.xml"
BESIDE_THE_REPOSITORY = Path(__file__).parents[3] / "shared" / "data" / "flight_plans"
PUBLIC_PLANS = Path(os.environ.get("DARKO_FLIGHT_PLANS", BESIDE_THE_REPOSITORY))

HEAD = (
    '<flight_plan name="t" lat0="43.5641" lon0="1.4829" ground_alt="100" alt="102" security_height="1" '
    'max_dist_from_home="100">'
)
WAYPOINTS = (
    '<waypoint name="HOME" x="0" y="0"/><waypoint name="A" x="3" y="4"/>'
    '<waypoint name="B" x="-2" y="1" height="3"/><waypoint name="C" x="2" y="-2" alt="104"/>'
)


def public_plans():
    """Paths of the public plans; empty where they are not there."""
    return sorted(path for path in PUBLIC_PLANS.rglob("*.xml")) if PUBLIC_PLANS.is_dir() else []


def plan_text(blocks, before=""):
    """The text of a plan with the waypoints HOME, A, B and C, these sections before its blocks, and these blocks."""
    return f"{HEAD}\n<waypoints>{WAYPOINTS}</waypoints>{before}\n<blocks>{blocks}</blocks></flight_plan>"


def plan_of(blocks, before=""):
    return read_flight_plan(plan_text(blocks, before).encode(), "t.xml")


def source(text):
    """An attribute's value, as if it stood at the beginning of a file."""
    return SourceText(text, Place("t", 1, 1), text)
