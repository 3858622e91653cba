"""The rates of the router in numbers: what one peer may cause, and what strangers share."""

import pytest

from protocol.dialect import mavlink
from protocol.endpoints.router import Withheld
from tests.support.links.routing_net import CAMERA, COMPANION, MAVPROXY, QGC, Net


def value(number):
    return mavlink.MAVLink_named_value_int_message(number, b"n", number)


def net(others=3):
    """A camera and other peers, all there for a while: a frame of the camera becomes so many datagrams."""
    made = Net(("camera", CAMERA), *(("qgc", QGC), ("mavproxy", MAVPROXY), ("companion", COMPANION))[:others])
    made.now += 10.0
    made.say("qgc", QGC)
    return made


def test_a_peer_causes_a_thousand_copies_a_second_and_two_hundred_of_the_reserve():
    routing = net()
    before = routing.end.routing.copies
    for number in range(4000):
        routing.now += 0.001
        routing.say("camera", CAMERA, value(number))
    copies = routing.end.routing.copies - before
    assert copies == pytest.approx(4 * (1000 + 200) + 250 + 200, rel=0.01)  # what came in, and what there was


@pytest.mark.parametrize(("others", "copies"), [(1, 250 + 200), (2, 250 + 200), (3, 249 + 198)])
def test_after_a_pause_there_are_250_copies_and_the_reserve_in_whole_frames(others, copies):
    routing = net(others)
    datagram = b"".join(routing.frame(CAMERA, value(number)) for number in range(600))
    assert len(routing.deliver("camera", datagram)) == copies
    assert routing.withheld == {Withheld.TOO_MANY: 600 - copies // others}
