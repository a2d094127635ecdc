"""What is known of eight motions, a row for each number and a column for each motion. SI units.

A motion in flight is p = Re sum t_j: three modes and the drive, each a turning and shrinking term, real and
imaginary part one below the other. What else moves follows from the terms alone.
"""

LANES = 8
TERMS = 4
"""Three modes, and the drive as the last."""
DRIVE_TERM = TERMS - 1
PAIR = 2 * TERMS
"""Rows of a complex number for each term."""
TERM = 0
RATE = TERM + PAIR
ONE_STEP = RATE + PAIR
"""What a term is multiplied with by a step of the grid."""
FOUR_STEPS = ONE_STEP + PAIR
ORDERS = 12
"""Of the series of a flight over a step: the next adds 0.25^12 / 12!."""
SERIES = FOUR_STEPS + PAIR
"""Taylor coefficients of exp(rate t), from the first order on."""
SQUARE = SERIES + PAIR * (ORDERS - 1)
"""abs(rate)^2."""
CUBE = SQUARE + TERMS
KICK = CUBE + TERMS
"""Reduced mass times what a unit impulse between m1 and m2 adds to the term of a mode."""
DRIVE = KICK + PAIR - 2
"""The drive's term once a drive period."""
LEFT = DRIVE + 2
"""Time until the next state once a drive period is due."""
PERIOD, FREQUENCY = LEFT + 1, LEFT + 2
GRID = LEFT + 3
"""A step [s]."""
COLUMN = GRID + 1
"""Rows that a motion comes with; those from here on are found on the way."""
BOUND, REACH, JERK = range(COLUMN, COLUMN + 3)
"""No abs(d2p/dt2), abs(p) and abs(d3p/dt3) is larger from now on, as long as nothing is touched."""
LOW, HIGH, LOW_FOUR, HIGH_FOUR = range(JERK + 1, JERK + 5)
"""Between these p must be at both ends of a step, of one or of four, for that to be clear of the stops."""
TOUCH = HIGH_FOUR + 1
"""Time until the stop is touched."""
NEXT = TOUCH + 1
"""Terms one step on."""
ROWS = NEXT + PAIR
KEPT = PAIR + 1
"""Numbers that are kept once a drive period: the terms, and how long before them the state was due."""
