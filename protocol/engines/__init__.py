"""The micro-services of MAVLink as engines without sockets and clocks: bytes and time enter as arguments.

Theory of operation
-------------------

An engine is one end of one service (https://mavlink.io/en/services/). It owns the state of that service and nothing
else: no socket, no thread, no clock. Its owner, an endpoint, drives it with five verbs:

- ``receive(message, now)`` hands in a decoded message; servers also get the ``peer`` that sent it. A message that is
  not for this engine, or arrives out of turn, is ignored or refused. It never raises an error: peers may send anything.
- A request such as ``upload(...)`` starts something. Asking out of turn is a mistake of this side and raises
  ``LocalProtocolError``.
- ``next_deadline()`` is the time of the next timeout, infinity if there is none; ``handle_timer(now)`` handles it.
- ``messages_to_send()`` returns and empties the outbox.
- ``events()`` returns what happened since the last call: records of ``protocol.events``.

The loop of every owner is therefore: receive or let time pass, then drain both outboxes, then set a timer for
``next_deadline()``.

Each engine with a state has a transition table, ``{(state, trigger): state}``; ``base.fire`` looks up the next state.
A pair that is not in the table is a request out of turn.

``now`` is any clock in seconds that never goes backwards. Tests use a virtual one: they hand the messages of a client
to a server through a lossy pipe, jump to the next deadline, and so run hours of retransmissions in milliseconds, with
the same result every time. ``retransmission`` has the timers: timeouts from measured round trips, when to repeat, when
to give up.

Folders
-------

- ``client``: engines that ask: a ground station's side of commands, missions, parameters, files and logs.
- ``server``: engines that answer: a vehicle's side of the same, and of streams, operator control and time.
- The modules beside them are shared by both. May import: ``protocol.events`` and below; no endpoint, router or link.
"""
