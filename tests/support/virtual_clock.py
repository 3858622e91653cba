"""Time that only tests move."""


class VirtualClock:
    """Seconds since the test began; it never goes back."""

    def __init__(self, start: float = 0.0) -> None:
        self.now = start

    def advance_to(self, instant: float) -> None:
        assert instant >= self.now, f"time cannot go back from {self.now} to {instant}"
        self.now = instant
