"""The two laws of forward flight, linear and along the line of sight, with their guidance and allocation.

Here belongs what flies on the wing alone; what hover shares belongs above. Imports control and the model's arithmetic.
"""
