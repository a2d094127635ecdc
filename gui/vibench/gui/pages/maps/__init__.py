"""The Maps page: what motions there are over frequency and amplitude, and the motion at any point of them.

The map is drawn while it is computed, first on a coarse grid. The visible part can be computed again on a
finer grid. A click shows the motion at a point; levels of recordings are drawn as lines.
"""
