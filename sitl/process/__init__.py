"""The vehicle as a running process, or several behind one port: first start, sockets, clock, and who flies whom.

Belongs here: what only a live vehicle needs. Each of several is the vehicle of a single run, with other arguments.
May import everything of the vehicle; only the commands import it.
"""
