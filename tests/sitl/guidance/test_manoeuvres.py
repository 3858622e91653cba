"""Manoeuvres by themselves: what they refer to, and when they are done."""

from sitl.control.reference import hover_at
from sitl.guidance.landing import LandingDescent
from sitl.guidance.manoeuvres import ComeToRest, FlyTo, Hold, ManoeuvreSequence, Ramp
from sitl.guidance.view import VehicleView

HERE = hover_at((0.0, 0.0, 20.0), 0.5)


def view(time=0.0, p=(0.0, 0.0, 20.0), v=(0.0, 0.0, 0.0), forward=False):
    return VehicleView(time, p, v, 0.0, 0.0, False, 1.0, forward=forward)


def test_a_hold_is_never_done():
    hold = Hold(HERE)
    assert hold.update(view()) is HERE
    assert not hold.done(view(1e6))


def test_coming_to_rest_is_done_upright_and_slow():
    rest = ComeToRest(HERE)
    assert not rest.done(view(v=(2.0, 0.0, 0.0)))
    assert not rest.done(view(forward=True))
    assert rest.done(view(p=(9.0, 0.0, 20.0)))  # however far from the reference


def test_a_flight_to_a_point_is_done_after_its_hold_time():
    leg = FlyTo(HERE, acceptance=0.5, hold=3.0)
    for time, p, done in (
        (0.0, (5.0, 0.0, 20.0), False),
        (1.0, (0.4, 0.0, 20.0), False),
        (4.0, (0.9, 0.0, 20.0), True),
    ):
        assert leg.update(view(time, p)) is HERE
        assert leg.done(view(time, p)) is done


def test_a_climb_ends_at_its_height():
    ramp = Ramp(HERE, rate=2.0)
    assert [ramp.update(view(time, (0.0, 0.0, 10.0))).position.z for time in (0.0, 2.0, 9.0)] == [10.0, 14.0, 20.0]
    assert ramp.done(view(p=(0.0, 0.0, 19.8)))


def test_to_pass_a_point_in_forward_flight_is_not_to_arrive():
    leg = FlyTo(HERE, acceptance=0.5)
    leg.update(view(forward=True))
    assert not leg.done(view(forward=True))
    leg.update(view(1.0))
    assert leg.done(view(1.0))


def test_a_sequence_goes_on_when_a_step_is_done():
    there = hover_at((9.0, 0.0, 20.0), 0.0)
    sequence = ManoeuvreSequence((FlyTo(HERE, 0.5), LandingDescent(there, 0.5)))
    assert not sequence.landing
    assert sequence.update(view()).position[:2] == (9.0, 0.0)
    sequence.update(view(p=(9.0, 0.0, 20.0)))
    assert sequence.landing
    assert not sequence.done(view())
