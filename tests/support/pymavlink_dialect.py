"""What pymavlink makes of our dialect: frames and messages are compared with it."""

from functools import cache

from scripts.build_dialect import DIALECT, load, pymavlink_module


@cache
def pymavlink_dialect():
    """Its module, made anew."""
    return load(pymavlink_module(DIALECT / "darko.xml"))
