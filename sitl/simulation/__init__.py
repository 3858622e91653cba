"""Time: the compiled loop of plant, sensors, estimate, laws and supervisor; single flights, batches, recordings.

Here belongs what makes a flight of the parts: the order of a control period, random draws, the class Simulation.
May import the model, estimation, control, design and the supervisor; knows no mission, mode or message.
"""
