"""The Compare page: curves of recordings and predictions, overlaid.

It shows curves with their bounds, their peaks, values at two markers, and the difference of two curves.
Analyses and exports run in another process.
"""
