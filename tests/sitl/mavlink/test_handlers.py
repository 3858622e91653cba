"""Handlers: marked methods are found by what they answer."""

import pytest

from protocol.events import CurrentItemRequested, ParameterChanged
from sitl.mavlink.handlers import answered_by, handlers_of, on_command, on_event, on_message


class Service:
    """Answers one of each."""

    @on_event(ParameterChanged)
    def change(self, event, now):
        return ("event", event, now)

    @on_message("SET_MODE", "MANUAL_CONTROL")
    def take(self, message):
        return ("message", message)

    @on_command(400)
    def arm(self, request):
        return ("command", request)

    def unmarked(self):
        """Answers nothing."""


class Rival:
    """Answers what Service answers too."""

    @on_event(ParameterChanged)
    def change(self, event, now):
        """Never called."""


def test_methods_are_found_by_what_they_answer():
    services = [Service()]
    assert handlers_of(services, type)[ParameterChanged]("changed", 1.0) == ("event", "changed", 1.0)
    assert handlers_of(services, int)[400]("arm") == ("command", "arm")
    assert {name: handler(name) for name, handler in handlers_of(services, str).items()} == {
        "SET_MODE": ("message", "SET_MODE"),
        "MANUAL_CONTROL": ("message", "MANUAL_CONTROL"),
    }
    assert CurrentItemRequested not in handlers_of(services, type)


def test_a_class_tells_what_it_answers_before_there_is_an_object():
    assert answered_by(Service, str) == {"SET_MODE": "take", "MANUAL_CONTROL": "take"}


def test_two_answers_to_the_same_are_an_error():
    with pytest.raises(TypeError, match="answered twice"):
        handlers_of([Service(), Rival()], type)
