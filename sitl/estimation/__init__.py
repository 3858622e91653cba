"""Estimation: what the vehicle believes of itself, made from what its sensors read of the plant.

Belongs here: the navigation filter, from the alignment to the estimate that the laws fly by. It sees readings alone;
the instruments that make them are in :mod:`sitl.sensors`.
May import the model, the sensors, and of control the estimate and the wind estimator; it knows no law in force.
"""
