"""Compare measurements and predictions as curves over frequency.

A curve is the ratio of m0's displacement to the base displacement over frequency [Hz], with its relative
standard deviation. It shows a transmission, Response I or Response II, which is measured, simulated or
predicted. The package also finds peaks, values at markers, and differences of curves.
"""
