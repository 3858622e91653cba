"""Measurements on many flights: campaign, break-even distance, region of attraction, costs of trims.

May import anything of the vehicle but its MAVLink face, and design; only the commands import it, never the vehicle.
It knows nothing of the scenarios and of the reproduction.
"""
