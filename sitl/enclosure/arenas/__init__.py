"""The arenas that are shipped."""
