"""The vehicle's MAVLink face: what it says, what it takes, and whom it believes."""
