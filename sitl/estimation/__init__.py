"""Estimation: what the vehicle believes of itself, made from what its sensors read of the plant.

Here belong sensor models and estimators: the only code on the laws' side that looks at the plant.
May import the model and the estimate's type in control; knows no law.
"""
