"""Plots on pyqtgraph: axes with units, 1-2-5 ticks, envelopes, legends, themes.

Values are in SI units; each axis converts them to its displayed unit. Long signals are drawn as the smallest
and largest sample in every pixel column, so that every impact is visible. The plots can show any quantity.
"""
