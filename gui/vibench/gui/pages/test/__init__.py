"""The Test page: the next signal, its loads, and the predicted response.

The page has a form for one measurement, and plots of the signal over time and frequency. Predicted loads are
shown beside the limits of the rig. Another process computes preview and predicted response.
"""
