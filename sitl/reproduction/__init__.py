"""The report reproduced: its experiments flown again, each number beside the printed one, with a verdict and its cause.

May import the scenarios, the simulation, the model and the design; only the commands import it, never the vehicle.
``equations`` are the report's models and laws, ``experiments`` its flights, ``textbook`` its training chapter.
"""
