"""DARKO_LEGS_REQUEST: what legs would take, without flying them."""

import math

import pytest

from darko_gcs.state.values import LegChain
from protocol.dialect.vocabulary import DecisionReason, LegMode
from tests.support.gcs.linked_station import LinkedStation
from tests.support.gcs.messages import VEHICLE

FAR = LegChain(points=((0.0, 0.0, -10.0), (150.0, 0.0, -10.0)), asked=(LegMode.NONE,), heading=0.0)
NEAR = LegChain(points=((0.0, 0.0, -10.0), (3.0, 0.0, -10.0)), asked=(LegMode.NONE,), heading=0.0)


@pytest.fixture(scope="module")
def link(tmp_path_factory):
    linked = LinkedStation(tmp_path_factory.mktemp("vehicle"), up=10.0)
    linked.run(1.5)
    return linked


def predicted(link, *chains):
    link.station.predict_legs(chains, link.now)
    assert link.run(3.0, lambda: all(chain in link.snapshot.leg_predictions for chain in chains))
    return [link.snapshot.leg_predictions[chain] for chain in chains]


def test_a_long_leg_is_cheaper_in_forward_flight_and_a_short_one_has_no_room_for_it(link):
    (far,), (near,) = predicted(link, FAR, NEAR)
    assert far.forward_energy < far.hover_energy
    assert far.forward_time < far.hover_time
    assert (far.leg_mode, far.reason) == (LegMode.FORWARD, DecisionReason.ENERGY)
    assert far.chosen == (far.forward_time, far.forward_energy)
    assert near.leg_mode == LegMode.HOVER
    assert 1.0 < near.hover_time < far.hover_time


def test_a_leg_is_predicted_the_way_that_it_is_asked_for(link):
    ((leg,),) = predicted(link, FAR._replace(asked=(LegMode.HOVER,)))
    assert (leg.leg_mode, leg.reason) == (LegMode.HOVER, DecisionReason.COMMAND)
    assert leg.chosen == (leg.hover_time, leg.hover_energy)


def test_legs_without_a_stop_between_share_their_transitions(link):
    corner = FAR._replace(points=(*FAR.points, (150.0, 150.0, -10.0)), asked=(LegMode.NONE, LegMode.NONE))
    (both, (alone,)) = predicted(link, corner, FAR)
    assert both[0].leg_mode == both[1].leg_mode == LegMode.FORWARD
    assert both[0].forward_energy < alone.forward_energy


def test_a_slower_hover_takes_longer(link):
    (slow,), (own,) = predicted(link, FAR._replace(hover_speed=1.0), FAR)
    assert slow.hover_time > 1.5 * own.hover_time


def test_a_leg_near_the_ground_cannot_be_flown_forward(link):
    low = FAR._replace(points=((0.0, 0.0, -1.0), (150.0, 0.0, -1.0)))
    ((leg,),) = predicted(link, low)
    assert (leg.leg_mode, leg.reason) == (LegMode.HOVER, DecisionReason.TOO_LOW)
    assert math.isinf(leg.forward_time)


def test_nothing_is_flown_and_nothing_told_of_a_prediction(link):
    before = link.snapshot.decision, link.vehicle.aircraft.autopilot.mode
    predicted(link, FAR._replace(heading=1.0))
    assert (link.snapshot.decision, link.vehicle.aircraft.autopilot.mode) == before


def test_a_request_without_sense_is_not_answered(link):
    bad = FAR._replace(points=((0.0, 0.0, -10.0), (math.nan, 0.0, -10.0)))
    link.station.predict_legs([bad], link.now)
    link.run(3.0)
    assert bad not in link.snapshot.leg_predictions
    link.run(11.0)  # the station rests
    predicted(link, FAR._replace(heading=2.0))


def test_only_so_many_requests_are_answered_in_a_second(link):
    chain = FAR._replace(heading=3.0)
    (before,) = predicted(link, chain)
    request, frames = link.sent[-1], 0
    link.station.predict_legs([chain], link.now)
    for _ in range(200):
        link.vehicle.receive(request, link.peer, link.now)
    frames = [VEHICLE.decode(data)[0].get_type() for _, data in link.vehicle.datagrams(link.now)]
    assert frames.count("DARKO_LEGS_PREDICTION") <= 20
    assert before
