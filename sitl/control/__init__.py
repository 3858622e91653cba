"""What steers: control laws, observers and allocation as pure functions of an estimate, a reference, gains and state.

A law sees what the vehicle believes of itself, never the plant. It takes its state and gives back the next one.
"""
