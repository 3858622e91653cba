"""The range of every number that peers send: of plan items, commands, set-points and other messages.

Stated here once, as data: the vehicle refuses by these tables, plan files are checked by them, docs/wire.md lists them.
"""
