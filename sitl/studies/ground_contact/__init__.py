"""Studies of how flights come to the ground: landings that begin anywhere, and contacts that there are none of."""
