"""Texts that several servers send: STATUSTEXT."""

from tests.support.links.vehicle_endpoint import endpoint, heard


def test_long_texts_are_split_into_chunks_that_join():
    vehicle, text = endpoint(), "Ä" * 30 + "x" * 40  # 100 bytes: two full chunks and an empty one to end them
    vehicle.status_text(4, text)
    chunks = [message for _, message in heard(vehicle)]
    assert [message.chunk_seq for message in chunks] == [0, 1, 2]
    assert len({message.id for message in chunks} - {0}) == 1
    assert b"".join(message._text_raw for message in chunks).decode() == text
    vehicle.status_text(6, "short")
    ((_, short),) = heard(vehicle)
    assert (short.text, short.id) == ("short", 0)
