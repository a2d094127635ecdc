"""Measurements and predictions overlaid as curves of one kind.

A curve is displacement of m0 over displacement of the base, against frequency [Hz], with its relative
standard deviation; a transmission, Response I or Response II, measured, simulated or predicted. Peaks,
readings at markers and differences of curves; how recordings are analysed for it. Nothing is drawn here.
"""
