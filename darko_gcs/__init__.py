"""The ground station in the terminal."""
