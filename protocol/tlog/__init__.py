"""Telemetry logs (``.tlog``): every frame of a flight, each behind the time it came.

The format is MAVProxy's and QGroundControl's: eight bytes of time (microseconds since 1970, most significant
byte first) and one raw frame of either version, again and again.
"""

from protocol.tlog.framing import split_frames
from protocol.tlog.reader import TlogReader, message_name, read_tlog
from protocol.tlog.scan import Damage
from protocol.tlog.writer import TlogWriter

__all__ = ["Damage", "TlogReader", "TlogWriter", "message_name", "read_tlog", "split_frames"]
