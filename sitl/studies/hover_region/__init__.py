"""The region where the linear hover law holds: proved, flown and drawn."""
