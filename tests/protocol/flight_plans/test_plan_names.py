"""Values of the names of a plan."""

from protocol.flight_plans import read_flight_plan
from protocol.flight_plans.plan_names import block_number, plan_constants, waypoint_numbers
from tests.support.plans import plan_text

TEXT = plan_text('<block name="a"/><block name="b"/>')  # ground 100 m, default altitude 102 m, security height 1 m


def constants(text):
    return plan_constants(read_flight_plan(text.encode(), "t"))


def test_heights_and_distances_are_those_of_the_plan():
    found = constants(TEXT)
    assert (found["GROUND_ALT"], found["NAV_DEFAULT_ALT"]) == (100.0, 102.0)
    assert (found["SECURITY_HEIGHT"], found["SECURITY_ALT"]) == (1.0, 101.0)
    assert (found["MAX_DIST_FROM_HOME"], found["max_dist_from_home"]) == (100.0, 100.0)


def test_the_vehicle_goes_home_at_the_security_height_unless_the_plan_has_another():
    assert constants(TEXT)["HOME_MODE_HEIGHT"] == 1.0
    assert constants(TEXT.replace('alt="102"', 'alt="102" home_mode_height="7"'))["HOME_MODE_HEIGHT"] == 7.0


def test_the_runway_is_north_unless_the_plan_has_another():
    assert constants(TEXT)["QFU"] == 0.0
    assert constants(TEXT.replace('alt="102"', 'alt="102" qfu="270"'))["QFU"] == 270.0


def test_waypoints_are_numbered_in_the_order_of_the_plan_and_home_is_behind_the_last_block():
    plan = read_flight_plan(TEXT.encode(), "t")
    numbers = waypoint_numbers(plan)
    assert numbers == {"HOME": 1, "A": 2, "B": 3, "C": 4}
    assert [constants(TEXT)[f"WP_{name}"] for name in ("dummy", *numbers)] == [0, 1, 2, 3, 4]
    assert [block_number(plan, name) for name in ("a", "b", "HOME", "c")] == [0, 1, 2, None]
