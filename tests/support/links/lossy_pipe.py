"""One direction of a bad link: seeded, so that a failure can be repeated."""

import heapq
import math
import random


class LossyPipe:
    """Datagrams go in with ``send`` and come out of ``receive`` late, twice, out of order, or never.

    ``drop``, ``duplicate`` and ``reorder`` are probabilities, ``delay`` is in seconds. A reordered datagram, and the
    second copy of a duplicated one, take up to twice the delay (at least up to 0.1 s longer).
    """

    def __init__(
        self, seed: int, *, drop: float = 0.0, delay: float = 0.0, duplicate: float = 0.0, reorder: float = 0.0
    ) -> None:
        self._random = random.Random(seed)
        self._drop, self._delay, self._duplicate, self._reorder = drop, delay, duplicate, reorder
        self._heap: list[tuple[float, int, bytes]] = []
        self._count = 0

    def send(self, data: bytes, now: float) -> None:
        if self._random.random() < self._drop:
            return
        self._push(data, now + self._delay + self._lateness(self._reorder))
        if self._random.random() < self._duplicate:
            self._push(data, now + self._delay + self._lateness(1.0))

    def next_arrival(self) -> float:
        return self._heap[0][0] if self._heap else math.inf

    def receive(self, now: float) -> list[bytes]:
        arrived = []
        while self.next_arrival() <= now:
            arrived.append(heapq.heappop(self._heap)[2])
        return arrived

    def _lateness(self, probability: float) -> float:
        late = self._random.random() < probability
        return self._random.random() * max(self._delay, 0.1) if late else 0.0

    def _push(self, data: bytes, at: float) -> None:
        self._count += 1  # datagrams of one time keep their order
        heapq.heappush(self._heap, (at, self._count, data))
