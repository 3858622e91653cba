"""The expressions of flight plans: read, written, and evaluated against a table of names.

Here belongs what an expression is and means; what plans do with it belongs above. Imports places and errors alone.
"""
