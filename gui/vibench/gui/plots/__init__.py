"""Plots on pyqtgraph: axes with units, 1-2-5 ticks, envelopes, legends, themes.

Values are SI; the unit of a label is chosen by its axis. Long signals are drawn as smallest and
largest sample of every column of pixels, so that no impact is lost.
It knows nothing of what is drawn.
"""
