"""The ground station's port: a warning if others can reach it, and one line if it cannot be opened."""

import pytest

from darko_gcs.commands import connect
from darko_gcs.errors import LinkError
from darko_gcs.feed.live_feed import LiveFeed
from darko_gcs.station.keyring_setup import open_keyring
from darko_gcs.station.station import Station

KEY, EVERYWHERE = "ab" * 32, "0.0.0.0"  # noqa: S104 - the address the warning is about


def test_without_an_option_it_listens_on_loopback():
    assert connect.parser({}).parse_args([]).host == "127.0.0.1"


@pytest.mark.parametrize(
    ("host", "key", "warned"), [(EVERYWHERE, None, 1), (EVERYWHERE, KEY, 0), ("127.0.0.1", None, 0)]
)
async def test_it_warns_about_an_open_port(host, key, warned):
    feed = LiveFeed(Station(keyring=open_keyring(key)), host, 0, None)
    await feed.open()
    try:
        texts = [entry.text for entry in feed.snapshot.messages]
    finally:
        await feed.close()
    assert sum("without a signing key" in text for text in texts) == warned


@pytest.mark.parametrize("host", ["a" * 300, "a..b", "\udcff"])
async def test_an_impossible_host_is_one_line(host):
    feed = LiveFeed(Station(), host, 0, None)
    with pytest.raises(LinkError, match=r"cannot listen on .{1,64}:0: "):
        await feed.open()
    await feed.close()
