"""Our ground station and a vehicle that flies a flight plan, byte for byte."""

import pytest

from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from protocol.dialect.vocabulary import PlanEventKind
from protocol.events import FlightPlanAnswered, FlightPlanReceived, MissionDownloaded
from protocol.flight_plans import load_flight_plan, render_flight_plan
from protocol.names import Mode
from protocol.tlog.reader import TlogReader
from sitl.defaults import HOME
from tests.support.gcs.linked_station import LinkedStation
from tests.support.plans import VOLIERE, plan_of
from tests.support.vehicle.planned_flight import PlannedFlight

TAKEOFF, STANDBY, ROUTE = 1, 2, 3
STDBY = 3  # number of the waypoint
RING = 2  # number of the variable


class PlannedLink(LinkedStation):
    """The link of a vehicle with a plan."""

    def __init__(self, folder, plan, **options):
        super().__init__(folder, aircraft=PlannedFlight(plan, **options).aircraft)
        self.start_sync()
        assert self.run(10.0, lambda: self.events_of(FlightPlanReceived))

    @property
    def plan(self):
        return self.snapshot.flight_plan

    @property
    def block(self):
        return self.plan.block_name(self.plan.block)


@pytest.fixture
def link(tmp_path):
    return PlannedLink(tmp_path, load_flight_plan(VOLIERE))


@pytest.mark.long
def test_a_plan_is_flown_from_the_ground_station(link):
    assert (link.plan.name, link.block, len(link.plan.blocks)) == ("Flying room", "Engine off", 11)
    assert link.snapshot.flies_plan
    link.station.flight_plan.jump_to_block(TAKEOFF, link.now)
    assert link.run(15.0, lambda: link.block == "Standby")  # the exception of the block ends it
    fired = [h for h in link.plan.happenings if h.kind == PlanEventKind.EXCEPTION]
    assert [(link.plan.block_name(h.from_block), h.text[:22]) for h in fired] == [("Takeoff", "GetPosHeight() @GT 1.5")]
    assert "[GetPosHeight() 1.5" in fired[0].text  # the value that it saw
    assert link.snapshot.status.armed

    link.station.flight_plan.move_waypoint(STDBY, (-1.0, 1.0, 2.5), link.now)
    assert link.run(1.0, lambda: link.plan.points[STDBY].position == (-1.0, 1.0, 2.5))
    assert link.run(
        15.0, lambda: abs(link.snapshot.position.p[0] - 1.0) < 0.3 and abs(link.snapshot.position.p[1] + 1.0) < 0.3
    )

    link.station.flight_plan.set_variable(RING, 2.0, link.now)
    assert link.run(1.0, lambda: link.plan.settings[RING].value == 2.0)
    link.station.flight_plan.set_variable(RING, 9.0, link.now)
    link.run(0.5)
    assert "Variable ring denied: 9 is not within 1..2.5" in link.text
    assert link.plan.settings[RING].value == 2.0


def test_requests_name_the_plan_that_the_operator_sees(link):
    link.vehicle.aircraft.autopilot.flight_plan.load(
        PlannedFlight(plan_of('<block name="Other"><stay wp="A"/></block>')).plan.executor.check
    )
    link.station.flight_plan.jump_to_block(0, link.now)  # before the station hears of it
    link.run(0.3)
    assert "another flight plan is loaded" in link.text
    assert link.run(5.0, lambda: [b.name for b in link.plan.blocks.values()] == ["Other", "HOME"])


@pytest.mark.long
def test_legs_of_a_plan_are_not_downloaded_as_missions_again_and_again(link):
    link.station.flight_plan.jump_to_block(TAKEOFF, link.now)
    link.run(12.0)
    link.station.flight_plan.jump_to_block(ROUTE, link.now)
    before = len(link.events_of(MissionDownloaded))
    link.run(12.0)
    assert len(link.events_of(MissionDownloaded)) == before
    link.station.set_mode(Mode.HOLD, link.now)
    assert link.run(5.0, lambda: link.snapshot.plans.mission == ())  # what was shown in its place is gone


@pytest.mark.long
def test_a_station_that_comes_again_knows_the_plan_and_what_happened(link):
    link.station.flight_plan.jump_to_block(TAKEOFF, link.now)
    assert link.run(15.0, lambda: link.block == "Standby")
    link.start_station()
    link.run(5.0)
    assert link.plan.is_complete
    told = [h.text[:10] for h in link.plan.happenings]
    assert told == ["Engine off", "Takeoff: c", "GetPosHeig", "Standby"]


def test_the_recording_shows_the_plan_again(link):
    link.station.flight_plan.jump_to_block(TAKEOFF, link.now)
    link.run(1.0)
    s = EMPTY_SNAPSHOT
    log = TlogReader(link.recording())
    for index in range(len(log)):
        s = reduce(s, log.decode(index), 0.0)
    assert (s.flight_plan.blocks, s.flight_plan.points) == (link.plan.blocks, link.plan.points)
    assert s.flight_plan.block == TAKEOFF


# Loading a plan

OTHER = render_flight_plan(plan_of('<block name="Other"><stay wp="A"/></block>'))


@pytest.fixture
def grounded(tmp_path):
    """The link of a vehicle on the ground, without a plan."""
    link = LinkedStation(tmp_path)
    assert link.run(10.0, lambda: link.snapshot.status.prearm_ok is not None)
    return link


def load(link, text):
    link.station.flight_plan.load(text.encode(), link.now)
    assert link.run(20.0, lambda: link.events_of(FlightPlanAnswered))
    return link.events_of(FlightPlanAnswered)[-1].text


def near(text):
    """A plan whose origin is the vehicle's."""
    return text.replace("43.5641", f"{HOME.lat_deg:.7f}").replace("1.4829", f"{HOME.lon_deg:.7f}")


def test_a_plan_is_loaded_on_the_ground(grounded):
    assert load(grounded, near(OTHER)) == ""
    assert grounded.run(
        5.0, lambda: grounded.snapshot.flight_plan is not None and grounded.snapshot.flight_plan.is_complete
    )
    assert [b.name for b in grounded.snapshot.flight_plan.blocks.values()] == ["Other", "HOME"]
    assert not grounded.snapshot.flies_plan
    grounded.station.flight_plan.start(grounded.now)
    assert grounded.run(2.0, lambda: grounded.snapshot.flies_plan)


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda text: text.replace("</blocks>", ""), "plan:"),
        (lambda text: text.replace('wp="A"', 'wp="NOWHERE"'), "NOWHERE"),
        (lambda text: text.replace("<stay", '<stay until="1 +"'), "ends too early"),
        (lambda text: text.replace(f"{HOME.lat_deg:.7f}", "10"), "its origin is out of reach"),
        (lambda _: "\x00 nonsense", "plan:"),
    ],
)
def test_a_plan_that_cannot_be_flown_is_refused_with_the_reason(grounded, change, reason):
    assert reason in load(grounded, change(near(OTHER)))
    assert grounded.snapshot.flight_plan is None
    assert "Flight plan refused" in grounded.text


def test_no_plan_is_loaded_while_the_vehicle_is_armed(link):
    link.station.arm(link.now)
    link.run(1.0)
    link.station.flight_plan.load(OTHER.encode(), link.now)
    assert link.run(20.0, lambda: link.events_of(FlightPlanAnswered))
    assert "land and disarm first" in link.text
    assert link.plan.name == "Flying room"
