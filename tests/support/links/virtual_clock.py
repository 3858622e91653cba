"""A clock that only tests advance."""


class VirtualClock:
    """Seconds since the start of the test; they never decrease."""

    def __init__(self, start: float = 0.0) -> None:
        self.now = start

    def advance_to(self, instant: float) -> None:
        assert instant >= self.now, f"time cannot go back from {self.now} to {instant}"
        self.now = instant
