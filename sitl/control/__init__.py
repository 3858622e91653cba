"""Control: the laws, observers and allocation, as pure functions of an estimate, a reference, gains and state.

Here belongs what computes actuator commands. A law sees the estimate, never the plant; it gives back its next state.
May import the model's arithmetic and airframe; neither the plant nor the supervisor.
"""
