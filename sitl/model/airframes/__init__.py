"""Shipped parameter sets of airframes, one TOML file each."""
