"""Messages of other vehicles on a link, decoded by a dialect of pymavlink."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega

from protocol.errors import LocalProtocolError
from protocol.wire.codec import Codec
from protocol.wire.other_dialects import OtherDialect
from tests.support.gcs.messages import heartbeat
from tests.support.logs import bare

REPORT = ardupilotmega.MAVLink_ekf_status_report_message(0, 0.1, 0.2, 0.3, 0.4, 0.5)


def frame():
    return bytes(REPORT.pack(ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)))


def test_a_message_that_ours_has_not_is_decoded_by_the_other_dialect():
    codec = Codec(255, 190, other=OtherDialect("ardupilotmega"))
    own, other = codec.decode(bare(heartbeat()) + frame())
    assert (own.get_type(), other.get_type()) == ("HEARTBEAT", "EKF_STATUS_REPORT")
    assert other.compass_variance == pytest.approx(0.4)
    assert other.get_msgbuf() == frame()
    assert codec.statistics.unknown_id == 0


def test_without_it_the_message_is_only_counted():
    codec = Codec(255, 190)
    assert codec.decode(frame()) == []
    assert codec.statistics.unknown_id == 1


def test_a_frame_with_a_wrong_checksum_is_damage_whatever_the_dialect():
    codec = Codec(255, 190, other=OtherDialect("all"))
    damaged = bytearray(frame())
    damaged[-1] ^= 0xFF
    assert codec.decode(bytes(damaged)) == []
    assert codec.statistics.bad_crc == 1


def test_an_unknown_dialect_is_refused_with_the_names_of_those_there_are():
    with pytest.raises(LocalProtocolError, match=r"no dialect ardupilot; it has .*ardupilotmega"):
        OtherDialect("ardupilot")
