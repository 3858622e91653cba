"""How the vehicle comes to know of itself: sensors and the truth, the only places that look at the plant for a law."""
