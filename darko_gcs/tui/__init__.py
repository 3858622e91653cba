"""The terminal application: screens, panels and keys of the ground station, live or on a recording.

Belongs here: everything that shows a snapshot or asks the operator. The app sends requests, panels only draw.
May import: ``darko_gcs.feed``, ``darko_gcs.station``, ``darko_gcs.state``, ``darko_gcs.errors`` and ``protocol``.
"""
