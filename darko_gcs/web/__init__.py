"""The terminal's screens in a browser.

Here belongs what serves them; screens belong into ``tui``. Imports textual-serve, and nothing else of this package.
"""
