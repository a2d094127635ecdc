"""The Maps page: kinds of motion over frequency and amplitude, and the motion at a chosen point.

The map is drawn while it is computed, at first on a coarse grid. Its visible part can be computed again on a
finer grid. A click shows the motion at that point. Base levels of recordings can be drawn over the map.
"""
