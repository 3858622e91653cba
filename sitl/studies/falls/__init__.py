"""Falls: of a law alone, of the whole vehicle, and the map of the height that they need."""
