"""Direct collocation against optima that are known in closed form, and its failures in one line."""

import math
from dataclasses import replace

import numpy as np
import pytest

ca = pytest.importorskip("casadi")
collocation = pytest.importorskip("sitl.lab.optimal.collocation")

ONES = np.ones(2)


def straight_course(time, begin, end, controls):
    return collocation.sampled_course(np.array([0.0, time]), np.stack([begin, end]), controls)


def double_integrator(begin, accel):
    """From a place and a speed to rest at 1."""
    x, u = ca.SX.sym("x", 2), ca.SX.sym("u")
    return collocation.ControlProblem(
        dynamics=ca.Function("dynamics", [x, u], [ca.vertcat(x[1], u), 0]),
        state_bounds=(-9.0 * ONES, 9.0 * ONES),
        control_bounds=(np.array([-accel]), np.array([accel])),
        start=np.array(begin),
        end=ca.Function("end", [x, u], [x]),
        end_bounds=(np.array([1.0, 0.0]), np.array([1.0, 0.0])),
        time_bounds=(0.1, 10.0),
        scales=(ONES, np.ones(1)),
    )


@pytest.mark.parametrize(
    ("begin", "accel", "time"),
    [((0.0, 0.0), 1.0, 2.0), ((0.0, 0.5), 1.0, 2.0 * math.sqrt(1.125) - 0.5), ((0.0, 0.0), 4.0, 1.0)],
)
def test_a_double_integrator_takes_the_time_of_bang_bang(begin, accel, time):
    problem = double_integrator(begin, accel)
    guess = straight_course(3.0, np.array(begin), np.array([1.0, 0.0]), 1)
    found = collocation.solve(problem, collocation.even_mesh(60), guess)
    assert found.course.time == pytest.approx(time, rel=1e-3)
    _, controls = found.course.at(np.array([0.1, 0.9]) * found.course.time)
    assert controls.ravel() == pytest.approx([accel, -accel], rel=1e-2)


def zermelo_time(shear, width):
    """Least time across a river whose stream is ``shear`` times the way from the bank, at speed 1, back to its line.

    E. Zermelo: the tangent of the heading is linear in time; both constants by the conditions at the end.
    """
    from scipy.integrate import solve_ivp
    from scipy.optimize import fsolve

    def ends(unknown):
        slope, time = unknown
        course = solve_ivp(
            lambda t, p: (np.cos(np.arctan(slope - shear * t)) + shear * p[1], np.sin(np.arctan(slope - shear * t))),
            (0.0, time), (0.0, 0.0), rtol=1e-10, atol=1e-12,
        )  # fmt: skip
        return course.y[0, -1] - 3.0, course.y[1, -1] - width

    return float(fsolve(ends, (1.0, 2.0))[1])


def test_a_zermelo_crossing_takes_the_least_time():
    shear, width = 0.5, 1.0
    x, u = ca.SX.sym("x", 2), ca.SX.sym("u")
    problem = replace(
        double_integrator((0.0, 0.0), 3.0),
        dynamics=ca.Function("boat", [x, u], [ca.vertcat(ca.cos(u) + shear * x[1], ca.sin(u)), 0]),
        end_bounds=(np.array([3.0, width]), np.array([3.0, width])),
    )
    guess = straight_course(3.0, np.zeros(2), np.array([3.0, width]), 1)
    found = collocation.solve(problem, collocation.even_mesh(40), guess)
    assert found.course.time == pytest.approx(zermelo_time(shear, width), rel=1e-3)


def test_what_cannot_be_solved_says_why_in_one_line():
    problem = replace(double_integrator((0.0, 0.0), 1.0), time_bounds=(0.1, 1.0))  # bang-bang takes 2 s
    guess = straight_course(1.0, np.zeros(2), np.array([1.0, 0.0]), 1)
    with pytest.raises(
        collocation.UnsolvedError, match=r"infeasible.* after \d+ iterations, constraints .* off"
    ) as told:
        collocation.solve(problem, collocation.even_mesh(10), guess)
    assert "\n" not in str(told.value)


def test_progress_is_told_in_every_iteration():
    told = []
    guess = straight_course(3.0, np.zeros(2), np.array([1.0, 0.0]), 1)
    found = collocation.solve(
        double_integrator((0.0, 0.0), 1.0), collocation.even_mesh(10), guess, lambda *values: told.append(values)
    )
    assert [iteration for iteration, _, _ in told] == list(range(found.iterations + 1))
    assert told[-1][1] == pytest.approx(2.0, rel=1e-2)
    assert told[-1][2] < 1e-5


def test_iterations_are_one_line_that_is_written_anew(capsys):
    tell = collocation.print_iterations("leg")
    tell(1, 2.0, 1e-3)
    tell(2, 1.5, 1e-5)
    text = capsys.readouterr().err
    assert text.count("\r") == 2
    assert "\n" not in text
    assert "iteration 2, cost 1.5, constraints 1e-05 off" in text


def test_a_course_goes_through_its_nodes_and_a_mesh_may_be_crowded_at_its_ends():
    times = np.array([0.0, 1.0, 2.0])
    course = collocation.sampled_course(times, np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 2.0]]), 1)
    states, controls = course.at(np.array([0.5, 1.0, 1.5, 2.0]))
    assert states == pytest.approx(np.array([[0.0, 0.0], [0.0, 0.0], [0.5, 1.0], [1.0, 2.0]]))
    assert controls.shape == (4, 1)
    crowded = np.diff(collocation.crowded_mesh(9))
    assert crowded[0] == pytest.approx(crowded[-1])
    assert crowded[0] < crowded[4]


def test_an_adapted_mesh_is_close_together_where_controls_are_busy():
    course = straight_course(8.0, np.zeros(2), np.ones(2), 1)
    times, points = np.linspace(0.0, 8.0, 17), collocation.DEGREE
    controls = np.zeros((16, 1))
    controls[4:8, 0] = 3.0, -3.0, 3.0, -3.0  # from 2 to 4 s
    course = course._replace(times=times, nodes=np.zeros((17, 2)), inner=np.zeros((16, points, 2)), controls=controls)
    nodes = 8.0 * collocation.adapted_mesh(course, 40, np.array([3.0]))
    assert len(nodes) == 41
    assert (nodes[0], nodes[-1]) == pytest.approx((0.0, 8.0))
    assert np.all(np.diff(nodes) > 0.0)
    busy = np.count_nonzero((nodes > 1.9) & (nodes < 4.1))
    assert busy > 20
    assert np.diff(nodes).max() < 0.6
    idle = course._replace(controls=np.zeros((16, 1)))
    assert collocation.adapted_mesh(idle, 10, np.ones(1)) == pytest.approx(collocation.crowded_mesh(10), abs=1e-2)
