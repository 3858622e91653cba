"""Measured propellers, one TOML file each."""
