"""The Maps page: what motions there are over frequency and amplitude, and the motion at any point of them.

The map is drawn while it is computed, coarsely first. What is in sight can be computed again, finer; a
click shows the motion there; levels of recordings lie on the map as lines.
"""
