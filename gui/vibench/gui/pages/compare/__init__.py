"""The Compare page: recordings and predictions overlaid on one another.

Curves with their bounds over frequency, peaks, markers, the difference of two curves, export.
Analyses and exports run in another process.
"""
