"""Hybrid systems of the report's training chapter: jumps as a table, solutions on hybrid time (t, j), examples.

May import arrays and errors alone; no flight uses it.
"""
