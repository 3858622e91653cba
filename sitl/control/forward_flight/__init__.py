"""The two laws of forward flight, linear and along the line of sight, with their guidance and allocation.

Here belongs what serves forward flight alone; what the hover shares belongs above. Imports control and the model's
arithmetic.
"""
