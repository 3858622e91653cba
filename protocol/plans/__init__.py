"""Plan files and the mission item they are made of."""
