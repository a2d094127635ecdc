"""Fit the parameters of the specimen on the shaker to the recordings of one campaign.

Damping and frequencies come from the weakest noise; the gap of each side comes from tracking a colliding
motion. A model that contradicts the recordings is refused, and assumptions that may be wrong are ranked.
Every value has bounds; values that the recordings do not determine are reported.
"""
