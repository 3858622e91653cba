"""Marks the methods that answer peers, beside their code, and finds them.

A method answers a kind of event of the endpoint (:func:`on_event`), a message that no engine of the endpoint takes
(:func:`on_message`), or a command that is not the autopilot's own (:func:`on_command`).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from protocol.events import CommandRequested, Event
from protocol.wire.message import Message
from sitl.autopilot.answers import Answer

Service = TypeVar("Service")
EventKind = TypeVar("EventKind", bound=Event)
Key = TypeVar("Key")

EventHandler = Callable[[Service, EventKind, float], None]
MessageHandler = Callable[[Service, Message], None]
CommandHandler = Callable[[Service, CommandRequested], Answer]

_ANSWERS = "answers"  # attribute of a marked method: what it answers


def on_event(kind: type[EventKind]) -> Callable[[EventHandler[Service, EventKind]], EventHandler[Service, EventKind]]:
    """Mark a method that answers events of a kind; it takes the event and the link's time [s]."""

    def mark(method: EventHandler[Service, EventKind]) -> EventHandler[Service, EventKind]:
        setattr(method, _ANSWERS, (kind,))
        return method

    return mark


def on_message(*names: str) -> Callable[[MessageHandler[Service]], MessageHandler[Service]]:
    """Mark a method that answers messages of these names; it takes the message."""

    def mark(method: MessageHandler[Service]) -> MessageHandler[Service]:
        setattr(method, _ANSWERS, names)
        return method

    return mark


def on_command(number: int) -> Callable[[CommandHandler[Service]], CommandHandler[Service]]:
    """Mark a method that carries out a MAV_CMD; it takes the request and gives the answer."""

    def mark(method: CommandHandler[Service]) -> CommandHandler[Service]:
        setattr(method, _ANSWERS, (number,))
        return method

    return mark


def answered_by(service: type, kind: type[Key]) -> dict[Key, str]:
    """Keys that a class of services answers, each with the name of its method.

    Args:
        service: The class.
        kind: What to look for: ``type`` for events, ``str`` for messages, ``int`` for commands.
    """
    methods = inspect.getmembers(service, inspect.isfunction)
    return {key: name for name, method in methods for key in getattr(method, _ANSWERS, ()) if isinstance(key, kind)}


def handlers_of(services: Iterable[object], kind: type[Key]) -> dict[Key, Callable[..., Any]]:
    """The marked methods of services, by what they answer.

    Args:
        services: Any objects with marked methods.
        kind: As for :func:`answered_by`.

    Raises:
        TypeError: Two methods answer the same.
    """
    found: dict[Key, Callable[..., Any]] = {}
    for service in services:
        for key, name in answered_by(type(service), kind).items():
            if key in found:
                raise TypeError(f"{key} is answered twice")
            found[key] = getattr(service, name)
    return found
