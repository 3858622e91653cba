"""Plans at the limits of their numbers, and one step beyond them."""

import pytest

from protocol.flight_plans import FlightPlanError, read_flight_plan
from tests.support.plans import plan_of, plan_text


def changed(old, new):
    text = plan_text('<block name="b"/>')
    assert old in text
    return read_flight_plan(text.replace(old, new).encode(), "t")


@pytest.mark.parametrize(
    ("old", "largest", "beyond", "words"),
    [
        ('lat0="43.5641"', 'lat0="89.9"', 'lat0="89.91"', "too near a pole"),
        ('lat0="43.5641"', 'lat0="-89.9"', 'lat0="-89.91"', "too near a pole"),
        ('lon0="1.4829"', 'lon0="180"', 'lon0="180.01"', "not on the globe"),
        ('lon0="1.4829"', 'lon0="-180"', 'lon0="-180.01"', "not on the globe"),
        ('ground_alt="100"', 'ground_alt="-100000"', 'ground_alt="-100001"', "not within 100000 m"),
        ('alt="102"', 'alt="100000"', 'alt="100001"', "alt 100001 is not within 100000 m"),
        ('security_height="1"', 'security_height="0"', 'security_height="-0.1"', "is negative"),
        ('max_dist_from_home="100"', 'max_dist_from_home="0.5"', 'max_dist_from_home="0"', "is not positive"),
        ('x="3" y="4"', 'lat="90" lon="-180"', 'lat="90.01" lon="0"', "is not on the globe"),
        ('x="3" y="4"', 'lat="-90" lon="180"', 'lat="0" lon="180.01"', "is not on the globe"),
        ('y="4"', 'y="4" alt="100000"', 'y="4" alt="100001"', "higher than 100000 m"),
        ('y="4"', 'y="4" height="-100000"', 'y="4" height="-100001"', "higher than 100000 m"),
    ],
)
def test_a_number_may_be_at_its_limit_and_not_beyond_it(old, largest, beyond, words):
    changed(old, largest)
    with pytest.raises(FlightPlanError, match=words):
        changed(old, beyond)


@pytest.mark.parametrize(("low", "high", "fits"), [("1", "2", True), ("2", "2", True), ("2.1", "2", False)])
def test_the_least_value_of_a_variable_is_not_above_its_greatest(low, high, fits):
    before = f'<variables><variable var="v" min="{low}" max="{high}"/></variables>'
    if fits:
        assert plan_of('<block name="b"/>', before).variables[0].max == 2.0
    else:
        with pytest.raises(FlightPlanError, match=r"min 2\.1 is above max 2"):
            plan_of('<block name="b"/>', before)


def test_a_fence_has_three_corners_and_a_path_two_waypoints_at_least():
    corners = "".join(f'<corner name="{name}"/>' for name in "ABC")
    plan = plan_of(
        '<block name="b"><path wpts="A B"/></block>', f'<sectors><sector name="S">{corners}</sector></sectors>'
    )
    assert len(plan.sectors[0].corners) == 3
    line = '<sectors><sector name="S"><corner name="A"/><corner name="B"/></sector></sectors>'
    text = plan_text('<block name="b"/>', line)
    assert len(read_flight_plan(text.encode(), "t").sectors[0].corners) == 2
    with pytest.raises(FlightPlanError, match="2 corners are too few for a fence"):
        read_flight_plan(text.replace("<flight_plan ", '<flight_plan geofence_sector="S" ').encode(), "t")
