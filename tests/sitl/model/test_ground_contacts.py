"""The ground contact by contact, against a second transcription: where each one is, what it feels, how it grips."""

import math

import numpy as np
import pytest

from sitl.model.airframe_files import load
from sitl.model.ground import LEVEL_GROUND, contact, feet_after, feet_aloft, foot, is_touching, point_motion
from sitl.model.quaternions import normalised
from sitl.model.state import Actuators, Body, Feet, Foot, Plant
from sitl.model.vectors import Vector
from tests.support.flights.estimates import quaternion, vector

A = load("nominal").parameters
STIFFNESS, DAMPING, FRICTION = 800.0, 10.0, 0.6  # [N/m], [N s/m], [-]
FEET = {  # body frame FLU [m]
    "left_upper": (-A.foot_x, A.foot_y, A.foot_z),
    "left_lower": (-A.foot_x, A.foot_y, -A.foot_z),
    "right_upper": (-A.foot_x, -A.foot_y, A.foot_z),
    "right_lower": (-A.foot_x, -A.foot_y, -A.foot_z),
}
POINTS = FEET | {
    "nose": (A.p_x, 0.0, 0.0),
    "left wing tip": (0.0, 0.5 * A.b, 0.0),
    "right wing tip": (0.0, -0.5 * A.b, 0.0),
}
DOWN = {  # the direction of the body that points to the ground when this contact is the lowest
    "left_upper": (-1.0, 0.6, 0.6),
    "left_lower": (-1.0, 0.6, -0.6),
    "right_upper": (-1.0, -0.6, 0.6),
    "right_lower": (-1.0, -0.6, -0.6),
    "nose": (1.0, 0.1, 0.2),
    "left wing tip": (0.1, 1.0, -0.2),
    "right wing tip": (0.1, -1.0, -0.2),
}


def matrix(q):
    """Body to world, (3, 3)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def attitude(point):
    """The shortest rotation that turns a point's direction straight down."""
    x, y, z = np.array(DOWN[point]) / np.linalg.norm(DOWN[point])
    return normalised(quaternion((1.0 - z, -y, x, 0.0)))


def height_of_foot(body):
    """Of the left lower one, to the bit as the ground takes it [m]."""
    return point_motion(body, foot(1.0, -1.0, A))[0].z


def standing_on(point, deep, v=(0.0, 0.0, 0.0), w=(0.0, 0.0, 0.0)):
    """A body whose lowest point, and no other, is ``deep`` below the ground [m]."""
    q = attitude(point)
    heights = {name: float((matrix(q) @ at)[2]) for name, at in POINTS.items()}
    assert all(heights[name] > heights[point] + 0.01 for name in POINTS if name != point)
    return Body(Vector(1.0, -2.0, -heights[point] - deep), vector(v), q, vector(w))


def motion(body, point):
    """Position [m] and velocity [m/s] of a point of the body in the world frame."""
    r = matrix(body.attitude)
    at = np.array(POINTS[point])
    return np.array(body.position) + r @ at, np.array(body.velocity) + r @ np.cross(body.rates, at)


@pytest.mark.parametrize("point", POINTS)
def test_a_point_below_the_ground_feels_its_spring_its_damper_and_friction(point):
    """At rest, sinking and rising: a rubbing contact of a foot that never touched down, or of the others."""
    for v, w in (((0, 0, 0), (0, 0, 0)), ((0.05, -0.02, -0.3), (0.2, -0.1, 0.3)), ((3.0, 1.0, 0.2), (0.5, 1.0, -2.0))):
        body = standing_on(point, 0.004, v, w)
        p, u = motion(body, point)
        assert p[2] == pytest.approx(-0.004)
        normal = max(0.0, 800.0 * 0.004 - DAMPING * u[2])
        rub = -DAMPING * u[:2]
        if np.hypot(*rub) > FRICTION * normal:
            rub *= FRICTION * normal / np.hypot(*rub)
        expected = np.array((*rub, normal))
        force, moment = contact(body, feet_aloft(), LEVEL_GROUND, A)
        assert force == pytest.approx(expected, abs=1e-9)
        assert moment == pytest.approx(np.cross(POINTS[point], matrix(body.attitude).T @ expected), abs=1e-9)


@pytest.mark.parametrize("point", FEET)
def test_a_foot_that_grips_pulls_towards_where_it_touched_down(point):
    body = standing_on(point, 0.004)
    p, _ = motion(body, point)
    for north, west, slides in ((1e-3, -5e-4, False), (0.02, 0.01, True)):
        feet = feet_aloft()._replace(**{point: Foot(True, p[0] + north, p[1] + west)})
        force, moment = contact(body, feet, LEVEL_GROUND, A)
        pull = STIFFNESS * np.array((north, west))
        limit = FRICTION * STIFFNESS * 0.004
        assert (np.hypot(*pull) > limit) == slides
        pull *= min(1.0, limit / np.hypot(*pull))
        expected = np.array((*pull, STIFFNESS * 0.004))
        assert force == pytest.approx(expected, abs=1e-9)
        assert moment == pytest.approx(np.cross(POINTS[point], matrix(body.attitude).T @ expected), abs=1e-9)
        others = Feet(*[Foot(True, 9.0, 9.0)] * 4)._replace(**{point: getattr(feet, point)})
        assert contact(body, others, LEVEL_GROUND, A) == (force, moment)  # feet in the air feel nothing


@pytest.mark.parametrize("point", FEET)
def test_a_foot_grips_where_it_touches_down_and_is_dragged_when_it_slides(point):
    body = standing_on(point, 0.004)
    p, _ = motion(body, point)
    assert feet_after(body, feet_aloft(), LEVEL_GROUND, A) == feet_aloft()._replace(**{point: Foot(True, *p[:2])})
    held = Feet(*[Foot(True, 9.0, 9.0)] * 4)._replace(**{point: Foot(True, p[0] + 1e-3, p[1] - 5e-4)})
    assert feet_after(body, held, LEVEL_GROUND, A) == feet_aloft()._replace(**{point: getattr(held, point)})
    reach = FRICTION * 0.004  # how far the spring can be stretched
    behind = Foot(True, p[0] + 0.03, p[1] - 0.04)
    dragged = getattr(feet_after(body, feet_aloft()._replace(**{point: behind}), LEVEL_GROUND, A), point)
    assert dragged.grips
    assert (dragged.north - p[0], dragged.west - p[1]) == pytest.approx((0.6 * reach, -0.8 * reach))


def test_a_foot_that_is_pressed_faster_may_be_stretched_further():
    body = standing_on("left_lower", 0.004, v=(0.0, 0.0, -0.2))
    p, _ = motion(body, "left_lower")
    far = feet_aloft()._replace(left_lower=Foot(True, p[0] + 1.0, p[1]))
    reach = FRICTION * (STIFFNESS * 0.004 + DAMPING * 0.2) / STIFFNESS
    assert feet_after(body, far, LEVEL_GROUND, A).left_lower.north - p[0] == pytest.approx(reach)
    rising = standing_on("left_lower", 0.004, v=(0.0, 0.0, 5.0))
    assert feet_after(rising, far, LEVEL_GROUND, A).left_lower == Foot(True, *p[:2])  # nothing holds it


@pytest.mark.parametrize("point", POINTS)
def test_a_point_touches_below_the_ground_and_not_at_it(point):
    def touches(body):
        return is_touching(Plant(body, Actuators(0.0, 0.0, 0.0, 0.0), feet_aloft()), LEVEL_GROUND, A)

    assert touches(standing_on(point, 1e-9))
    assert not touches(standing_on(point, -1e-9))


def test_a_point_exactly_at_the_ground_feels_nothing_however_fast_it_sinks():
    body = standing_on("left_lower", 0.0, v=(0.0, 0.0, -3.0))
    for _ in range(3):  # to the last bit
        body = body._replace(position=Vector(1.0, -2.0, body.position.z - height_of_foot(body)))
    assert height_of_foot(body) == 0.0
    assert contact(body, feet_aloft(), LEVEL_GROUND, A) == (Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0))
    assert feet_after(body, feet_aloft(), LEVEL_GROUND, A) == feet_aloft()
    assert not is_touching(Plant(body, Actuators(0.0, 0.0, 0.0, 0.0), feet_aloft()), LEVEL_GROUND, A)


def test_constants_in_numbers():
    """The vehicle sinks 1.5 mm under its weight on four springs."""
    assert A.m * A.g / (4 * STIFFNESS) == pytest.approx(1.5e-3, abs=5e-5)
    assert math.isclose(contact(standing_on("nose", 0.01), feet_aloft(), LEVEL_GROUND, A)[0].z, 8.0)
