"""A day of flying under a net, from one file: arena, plan, wind, failures and the operator's actions.

Belongs here: the file, its events on the vehicle's clock, the fast flight and its page.
May import: everything of the vehicle; only the commands and the process import it.
"""
