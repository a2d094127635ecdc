"""The Test page: the next signal, its loads, and the predicted response.

It has a form for one measurement, and plots of its signal over time and frequency. Predicted loads are shown
beside the limits of the rig. Another process computes preview and predicted response.
"""
