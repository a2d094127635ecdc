"""How a flight ends, and the step on which it is looked at."""

from ._detection import LONGEST_TURN

GRID_TURN = LONGEST_TURN
"""Grid step as the fastest rate times its length [rad]: half as long is slower by a seventh."""
CLEAR, TOUCHES, OUT_OF_RANGE, LIFTS_OFF = range(4)
"""How a flight ends; the last: it has surely left the rigid stop on which m1 stood, and goes on."""
