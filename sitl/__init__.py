"""The vehicle: model, control laws, hybrid supervisor, autopilot and its MAVLink face."""
