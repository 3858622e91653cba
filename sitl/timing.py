"""The control period: what one tick of sensors, estimator and laws takes."""

PERIOD = 0.002  # [s]
