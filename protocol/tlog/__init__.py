"""Telemetry logs (``.tlog``): every frame of a flight with its time, read fast as arrays, written without gaps.

The format is that of MAVProxy and QGroundControl: for each record a time stamp (8 bytes, microseconds since 1970,
big-endian) and one raw frame of either version.
"""

from protocol.tlog.message_set import message_name
from protocol.tlog.reader import LogOrigin, TlogReader, read_tlog
from protocol.tlog.scan import Damage
from protocol.tlog.writer import TlogWriter

__all__ = ["Damage", "LogOrigin", "TlogReader", "TlogWriter", "message_name", "read_tlog"]
