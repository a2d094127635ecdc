"""What is observed while a run goes by, without keeping the trajectory: peaks and lines. SI units.

A tally is an array: the largest abs(x) and abs(p), and the integrals of x and p against
exp(-i (omega t + phase)). The peaks are extremes of the motion itself, not of samples; the lines are in
closed form over flights, and by the corrected trapezoidal rule (error ~ step^4) over the steps of contacts.
"""

MODE, PEAK_X, PEAK_P, LINE_X_RE, LINE_X_IM, LINE_P_RE, LINE_P_IM = range(7)
OBSERVATIONS_SIZE = 7
NOTHING, PEAKS, PEAKS_AND_LINES = 0.0, 1.0, 2.0
"""What ``tally[MODE]`` asks for."""
SECANTS = 4
"""Secant steps to an extreme: its value then errs by less than rounding."""
