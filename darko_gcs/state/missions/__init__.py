"""Missions as values that an operator edits: items and their legs, differences, what the vehicle predicts of them.

Here belongs what is computed of a plan without the vehicle's other state. Imports ``protocol`` and values.
"""
