"""Files on offer over MAVLink FTP: parameters, plans and component metadata; logs come from the flight recorder.

Here belongs what a file's content is made of. May import the parameters' table and ``protocol``.
"""
