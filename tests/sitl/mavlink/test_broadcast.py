"""The limiter of texts: a burst, then one a second, no repetition, and a summary of what was withheld."""

from sitl.mavlink.broadcast import MAX_BURST, MAX_REMEMBERED, StatustextLimiter


def test_a_burst_is_sent_and_then_one_text_a_second():
    limiter = StatustextLimiter()
    assert sum(limiter.admits(f"text {n}", 0.0) for n in range(100)) == MAX_BURST
    assert sum(limiter.admits(f"more {n}", 0.01 * n) for n in range(500)) == 4


def test_the_same_text_is_not_repeated_at_once_and_costs_nothing():
    limiter = StatustextLimiter()
    assert limiter.admits("again", 0.0)
    assert not any(limiter.admits("again", 0.01 * n) for n in range(99))
    assert limiter.admits("again", 1.0)
    assert not limiter.admits("again", 5.0, repeat_after=10.0)
    assert limiter.summary(100.0) == ""


def test_withheld_texts_are_counted_once_there_is_room_again():
    limiter = StatustextLimiter()
    for n in range(MAX_BURST + 7):
        limiter.admits(f"text {n}", 0.0)
    assert limiter.summary(1.0) == ""
    assert limiter.summary(MAX_BURST / 2) == "7 further answers were not sent"
    assert limiter.summary(MAX_BURST) == ""


def test_it_remembers_a_bounded_number_of_texts():
    limiter = StatustextLimiter()
    for n in range(10 * MAX_REMEMBERED):
        limiter.admits(f"text {n}", 2.0 * n)
    assert limiter.remembered == MAX_REMEMBERED
