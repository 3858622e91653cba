"""Descriptions of parameters that are kept for recordings."""

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.station.parameter_requests import KnownParameters
from protocol.tlog import TlogReader, read_tlog
from tests.support.gcs.messages import heartbeat
from tests.support.logs import bare, log_of
from tests.support.paths import DATA

FILE = b'{"parameters": [{"name": "DRK_KPP", "type": "Float", "shortDesc": "a gain", "default": 2.0}]}'


def test_what_the_vehicle_told_names_the_parameters_of_a_recording_of_it(tmp_path):
    known = KnownParameters(tmp_path / "state" / "parameters.json")
    assert known.load() == {}
    known.keep(FILE)
    meanings = known.load()
    assert meanings["DRK_KPP"].text == "a gain"
    own = ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "x", parameters=meanings)
    own.seek(own.duration)
    assert own.snapshot.parameter_metadata == meanings
    other = ReplayFeed(TlogReader(log_of([bare(heartbeat())])), "x", parameters=meanings)
    assert other.snapshot.parameter_metadata == {}


def test_a_broken_file_or_a_folder_that_cannot_be_written_costs_only_the_names(tmp_path):
    (tmp_path / "broken").write_bytes(b"{")
    assert KnownParameters(tmp_path / "broken").load() == {}
    KnownParameters(tmp_path / "broken" / "below").keep(FILE)
