"""The step on which a flight is looked at, and the force of its base."""

from .detection import LONGEST_TURN

GRID_TURN = LONGEST_TURN
"""Grid step as the fastest rate times its length [rad]: half as long is slower by a seventh."""
FORCE_TERMS = 8
"""A base force is a polynomial of degree 7 in the time since its middle."""
