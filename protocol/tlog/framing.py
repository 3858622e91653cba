"""What a record of a telemetry log is made of."""

__all__ = ["SIGNATURE", "SIGNED", "STAMP", "TIME_LIMIT", "V1", "V2", "frame_length", "split_frames"]

V1, V2 = 0xFE, 0xFD  # first byte of a frame, by version
STAMP = 8  # bytes of time before each frame
TIME_LIMIT = 1 << 53  # [us]: times are whole numbers that a float64 holds exactly
SIGNED, SIGNATURE = 0x01, 13  # the only incompatibility flag that is understood, and the bytes it announces


def frame_length(data: bytes, at: int = 0) -> int:
    """Length of the whole frame at ``at``; 0 when there is none."""
    left = len(data) - at
    if left >= 12 and data[at] == V2:
        length = 12 + data[at + 1] + (SIGNATURE if data[at + 2] & SIGNED else 0)
    elif left >= 8 and data[at] == V1:
        length = 8 + data[at + 1]
    else:
        return 0
    return length if length <= left else 0


def split_frames(datagram: bytes) -> list[bytes]:
    """Whole frames at the beginning of a datagram, by their length alone; what follows them is left out."""
    frames, at = [], 0
    while length := frame_length(datagram, at):
        frames.append(datagram[at : at + length])
        at += length
    return frames
