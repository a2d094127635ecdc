"""Plots on pyqtgraph: axes with units, 1-2-5 ticks, envelopes, legends, themes.

Values are SI; each axis chooses the unit of its label. Long signals are drawn as the smallest and largest
sample of every pixel column, so that no impact is lost. The plots are independent of the quantities drawn.
"""
