"""Ovals, eights and surveys are closed, turn the right way and go on for ever."""

import math

import pytest

from protocol.flight_plans.flight_plan import EnuPoint
from sitl.autopilot.flight_plan.aims import bearing_between
from sitl.autopilot.flight_plan.patterns import PieceTracker, eight_pieces, oval_pieces, survey_pieces

ONE, TWO = EnuPoint(0.0, 0.0, 5.0), EnuPoint(30.0, 40.0, 9.0)


def arc_end(piece):
    size = abs(piece.radius)
    return (piece.end.x + size * math.sin(piece.until), piece.end.y + size * math.cos(piece.until))


def ends(piece):
    """Start and end of a piece."""
    return (piece.start[:2], piece.end[:2] if piece.radius == 0.0 else arc_end(piece))


@pytest.mark.parametrize("radius", [8.0, -8.0])
@pytest.mark.parametrize("make", [oval_pieces, eight_pieces])
def test_pieces_join_without_a_corner(make, radius):
    pieces = make(ONE, TWO, radius)
    assert len(pieces) == 4
    for piece, following in zip(pieces, (*pieces[1:], pieces[0]), strict=True):
        assert ends(piece)[1] == pytest.approx(ends(following)[0], abs=1e-9)
    assert {piece.end.z for piece in pieces if piece.radius} <= {5.0, 9.0}
    for leg, arc in ((a, b) for a, b in zip(pieces, (*pieces[1:], pieces[0]), strict=True) if a.radius == 0.0):
        along = (leg.end.x - leg.start.x, leg.end.y - leg.start.y)
        out = (leg.end.x - arc.end.x, leg.end.y - arc.end.y)
        clockwise = (out[1], -out[0]) if arc.radius > 0 else (-out[1], out[0])
        assert along[0] * clockwise[0] + along[1] * clockwise[1] > 0.0  # the arc goes on where the leg leads


def test_an_oval_turns_one_way_and_an_eight_both():
    assert {p.radius for p in oval_pieces(ONE, TWO, 8.0)} == {0.0, 8.0}
    assert {p.radius for p in eight_pieces(ONE, TWO, 8.0)} == {0.0, 8.0, -8.0}


@pytest.mark.parametrize("make", [oval_pieces, eight_pieces])
def test_points_on_each_other_have_no_pattern(make):
    assert make(ONE, ONE, 8.0) == ()


def test_the_tracker_goes_round():
    tracker = PieceTracker(oval_pieces(ONE, TWO, 8.0))
    flown = []
    p = EnuPoint(*tracker.pieces[0].start[:2], 5.0)
    for _ in range(3000):
        piece = tracker.at(p)
        if not flown or flown[-1] is not piece:
            flown.append(piece)
        if piece.radius == 0.0:
            course = bearing_between(piece.start, piece.end)
        else:
            course = bearing_between(piece.end, p) + math.copysign(0.5 * math.pi, piece.radius)
        p = EnuPoint(p.x + 0.1 * math.sin(course), p.y + 0.1 * math.cos(course), 5.0)
    assert len(flown) >= 8
    assert flown[:4] == list(tracker.pieces)
    assert flown[4:8] == list(tracker.pieces)


@pytest.mark.parametrize(("north_south", "length"), [(True, 40.0), (False, 30.0)])
def test_a_survey_sweeps_the_rectangle_and_comes_back(north_south, length):
    pieces = survey_pieces(ONE, TWO, 10.0, north_south=north_south)
    lines = [p for p in pieces if math.dist(p.start[:2], p.end[:2]) == pytest.approx(length)]
    across = {round((p.start.x if north_south else p.start.y), 6) for p in lines}
    assert across == ({0.0, 10.0, 20.0, 30.0} if north_south else {0.0, 10.0, 20.0, 30.0, 40.0})
    for piece, following in zip(pieces, (*pieces[1:], pieces[0]), strict=True):
        assert piece.end[:2] == following.start[:2]
    assert {p.end.z for p in pieces} == {5.0}


def test_what_follows_a_leg_without_a_stop():
    survey = PieceTracker(survey_pieces(ONE, TWO, 10.0, north_south=True))
    assert survey.followers()[:2] == (survey.pieces[1].end, survey.pieces[2].end)
    for radius, count in ((15.0, 1), (2.0, 0)):
        oval = PieceTracker(oval_pieces(ONE, TWO, radius), index=1)
        assert len(oval.followers()) == count
    leg, (beyond,) = oval_pieces(ONE, TWO, 15.0)[1], PieceTracker(oval_pieces(ONE, TWO, 15.0), index=1).followers()
    assert math.dist(beyond[:2], leg.end[:2]) == pytest.approx(60.0)
    assert bearing_between(leg.end, beyond) == pytest.approx(bearing_between(leg.start, leg.end))


def test_a_survey_has_a_limit():
    far = EnuPoint(1e5, 1e5, 0.0)
    assert len(survey_pieces(ONE, far, 1e-9, north_south=True)) < 2000
