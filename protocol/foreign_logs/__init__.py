"""Logs of other autopilots, read as the telemetry that their vehicle would have sent.

Everything that reads telemetry logs thus reads them: PX4's ULog, ArduPilot's DataFlash, Paparazzi's ``.log`` with its
``.data``.
"""

from protocol.foreign_logs.any_log import read_log

__all__ = ["read_log"]
