"""Commands that measure over many flights: what ``sitl.studies`` flies, with its arguments and what it prints.

Belongs here: one module for each such command, and what they share. May import everything of the vehicle; nothing
imports it but the command line.
"""
