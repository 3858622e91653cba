"""Specifications of the instruments, a TOML file each."""
