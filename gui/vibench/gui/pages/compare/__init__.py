"""The Compare page: recordings and predictions overlaid on one another.

It shows curves with their bounds, their peaks, two markers and the difference of two curves.
Analyses and exports run in another process.
"""
