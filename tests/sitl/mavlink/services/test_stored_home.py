"""Home and origin between runs: stored, restored where they fit, and reported where they do not."""

from dataclasses import replace

import pytest

from protocol.dialect import mavlink
from protocol.frames import Geodetic
from sitl.errors import SitlError
from sitl.mavlink.services.home_service import StoredHome
from sitl.tools.persistence import StateFolder
from tests.support.vehicle.fake_station import HOME, Bench
from tests.support.vehicle.home_messages import global_waypoint, request_message, set_home, set_origin

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
ELSEWHERE = Geodetic(48.1, 11.6, 520.0)


def test_home_is_restored_and_the_stored_mission_fits_it(tmp_path):
    station = Bench(tmp_path, up=3.0).station()
    set_home(station, 10.0, -4.0, 170.0)
    before = station.last("HOME_POSITION")
    assert station.upload([global_waypoint(4.0, 0.0, 1475.0)]) == 0
    again = Bench(tmp_path)
    sent = request_message(again.station(), mavlink.MAVLINK_MSG_ID_HOME_POSITION)
    assert (sent.latitude, sent.longitude, sent.altitude) == (before.latitude, before.longitude, before.altitude)
    assert again.autopilot.world.home == pytest.approx((10.0, 4.0, 20.0), abs=0.02)
    assert again.autopilot.mission is not None


def test_the_stored_home_of_another_site_is_not_used_but_kept_for_its_own(tmp_path):
    set_home(Bench(tmp_path, up=3.0).station(), 10.0, 0.0, 150.0)
    far = Bench(tmp_path, origin=ELSEWHERE)
    assert far.autopilot.world.home == (0.0, 0.0, 0.0)
    (notice,) = StoredHome(far.autopilot, StateFolder(tmp_path)).notices
    assert notice.text.startswith("Stored home not used: it belongs to a start")
    assert Bench(tmp_path).autopilot.world.home == pytest.approx((10.0, 0.0, 0.0), abs=0.02)


def test_an_invalid_stored_origin_is_reported_and_not_used(tmp_path):
    set_home(Bench(tmp_path, up=3.0).station(), 10.0, 0.0, 150.0)
    stored = (tmp_path / "home.json").read_text()
    (tmp_path / "home.json").write_text(
        stored.replace('"origin": {\n  "lat_deg": 43.5648', '"origin": {"lat_deg": 89.9')
    )
    bench = Bench(tmp_path)
    assert bench.autopilot.world.home == (0.0, 0.0, 0.0)
    (notice,) = StoredHome(bench.autopilot, StateFolder(tmp_path)).notices
    assert notice.text == "Stored origin not used: latitude 89.9 is too near a pole"


@pytest.mark.parametrize(
    "text",
    ['{"start": 1}', "[]", '{"start": {"lat_deg": 1e400, "lon_deg": 0, "alt": 0}}', "\x00"],
)
def test_an_invalid_file_is_one_line_with_its_name_and_the_remedy(tmp_path, text):
    (tmp_path / "home.json").write_text(text)
    with pytest.raises(SitlError, match=r"home\.json: .*delete the file"):
        Bench(tmp_path)


def test_the_same_home_again_is_accepted_but_not_written(tmp_path):
    hovering = Bench(tmp_path, up=3.0)
    station = hovering.station()
    set_home(station, 10.0, 0.0, 150.0)
    (tmp_path / "home.json").unlink()
    hovering.advance(2.0)  # so that it is not taken for a repetition
    assert set_home(station, 10.0, 0.0, 150.0) == ACCEPTED
    assert not (tmp_path / "home.json").exists()


def test_the_origin_is_stored(tmp_path):
    station = Bench(tmp_path).station()
    set_home(station, 10.0, 0.0, 152.0)
    set_origin(station, ELSEWHERE)
    again = Bench(tmp_path)
    assert again.autopilot.world.frame.origin == ELSEWHERE
    assert again.autopilot.world.home == pytest.approx((10.0, 0.0, 2.0), abs=0.02)
    texts = [notice.text for notice in StoredHome(Bench(tmp_path / "other").autopilot, StateFolder(tmp_path)).notices]
    assert texts[0] == "Stored origin is 48.1000000, 11.6000000, 520.0 m"


def test_an_origin_that_was_never_moved_is_where_the_vehicle_starts(tmp_path):
    set_home(Bench(tmp_path, up=3.0).station(), 10.0, 0.0, 152.0)
    again = Bench(tmp_path, origin=replace(HOME, alt=149.0))
    assert again.autopilot.world.frame.origin.alt == 149.0
    assert again.autopilot.world.home == pytest.approx((10.0, 0.0, 3.0), abs=0.02)
