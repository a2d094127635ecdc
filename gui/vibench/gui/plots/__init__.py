"""Plots on pyqtgraph: axes with units, 1-2-5 ticks, envelopes, legends, themes.

Values are in SI units; each axis converts them to its unit. Long signals are drawn as the smallest and
largest sample of every pixel column, so that no impact is lost. The plots can show any quantity.
"""
