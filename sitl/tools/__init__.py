"""Tools that know no law, no model and no message: compiler and its cache, files, plots, worker processes, the pacer.

Belongs here: what any room may need and what would serve another vehicle as well. May import ``protocol`` and the
errors, no room.
"""
