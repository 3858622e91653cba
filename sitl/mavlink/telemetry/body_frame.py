"""The body frame of every message: the hover frame of a tail-sitter, as PX4 has it, also in forward flight.

A nose-up hover is level; level forward flight has pitch -90 deg, and a ``repr_offset_q`` that displays pitch it up by.
"""

from __future__ import annotations

from protocol import frames


def attitude_on_wire(q: frames.Array) -> frames.Quaternion:
    """An attitude as messages tell it, hover frame FRD -> NED, from the vehicle's own, FLU -> NWU."""
    return frames.hover_attitude(frames.flip_quaternion(q))


def axes_on_wire(v: frames.Array) -> frames.Vector:
    """A body vector as messages tell it, hover frame FRD, from the vehicle's own, FLU."""
    return frames.hover_axes(frames.flip(v))
