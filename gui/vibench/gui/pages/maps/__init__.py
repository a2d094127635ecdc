"""The Maps page: kinds of motion over frequency and amplitude, and the motion at any point.

The map is drawn while it is computed, first on a coarse grid. The visible part can be computed again on a
finer grid. A click shows the motion at a point; levels of recordings are drawn as lines.
"""
