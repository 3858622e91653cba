"""The guard: reported or raised, and the place of an error."""

import math

import pytest

from sitl.tools.error_guard import ErrorGuard, place_of, traceback_of


@pytest.fixture
def guard(monkeypatch):
    monkeypatch.setattr(ErrorGuard, "raises", False)
    return ErrorGuard()


def error_of(call):
    try:
        call()
    except Exception as error:
        return error
    raise AssertionError("no error")


def test_without_anybody_to_report_to_an_error_is_raised(guard):
    with pytest.raises(ZeroDivisionError), guard:
        1 / 0  # noqa: B018


def test_an_error_is_reported_and_what_follows_the_block_goes_on(guard):
    reported = []
    guard.report = reported.append
    with guard:
        1 / 0  # noqa: B018
    assert [type(error) for error in reported] == [ZeroDivisionError]


def test_an_interrupt_is_no_error(guard):
    guard.report = lambda _error: None
    with pytest.raises(KeyboardInterrupt), guard:
        raise KeyboardInterrupt


def test_a_place_is_the_deepest_of_our_own_code():
    error = error_of(lambda: ErrorGuard().__exit__(None, error_of(lambda: math.sqrt(-1.0)), None) or place_of(None))
    assert place_of(error).startswith("place_of (error_guard.py:")
    assert place_of(ValueError("never raised")) == "an unknown place"
    assert traceback_of(error).startswith("Traceback (most recent call last)")
