"""Several vehicles in one process group, on one port: where each starts, which datagram is whose, who flies whom.

Belongs here: what several vehicles share. Each of them is the vehicle of a single run, with other arguments.
May import: everything of the vehicle; only the command line imports it.
"""
