"""The vehicle: model, control laws, hybrid supervisor, autopilot and its MAVLink face."""

from sitl._kernel_cache import use_source_keyed_cache

use_source_keyed_cache()
