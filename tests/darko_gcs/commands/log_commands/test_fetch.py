"""Output of ``darko-gcs log fetch``."""

import json

from darko_gcs.commands.log_commands.fetch import downloads_as_json, downloads_as_text
from darko_gcs.tasks.log_download import DownloadedLogs
from protocol.events import RemoteLog

LOGS = (RemoteLog(0, 1_790_000_000, 100), RemoteLog(1, 0, 200), RemoteLog(2, 0, 0))


def test_logs_are_listed_with_size_and_date():
    listing = downloads_as_text(DownloadedLogs(LOGS, {}))
    assert listing.splitlines()[0] == "log 0: 100 bytes, 2026-09-21 14:13:20 UTC"
    assert downloads_as_text(DownloadedLogs((), {})) == "the vehicle has no logs"


def test_downloaded_logs_are_printed_with_their_files(tmp_path):
    downloaded = DownloadedLogs(LOGS, {1: tmp_path / "a.tlog"})
    assert downloads_as_text(downloaded) == f"log 1 -> {tmp_path / 'a.tlog'}"
    logs = json.loads(downloads_as_json(downloaded))["logs"]
    assert logs[1] == {"number": 1, "began": None, "bytes": 200, "file": str(tmp_path / "a.tlog")}
    assert logs[0]["file"] is None
