"""The dialect as pymavlink makes it, with which frames and messages are compared."""

from functools import cache

from scripts.build_dialect import DIALECT, load, pymavlink_module


@cache
def pymavlink_dialect():
    """Its module, made anew."""
    return load(pymavlink_module(DIALECT / "darko.xml"))
