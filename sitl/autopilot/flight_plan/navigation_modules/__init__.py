"""Navigation modules of Paparazzi: functions that a plan calls again and again, and what they fly meanwhile."""
