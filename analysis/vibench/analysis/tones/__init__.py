"""Sines in a signal: their frequency, amplitude and phase, peaks of spectra, and orders of the drive.

Here the drive amplitude A0 of the paper, base displacement [m], is found from recorded base acceleration,
and how far noise lifts the largest value of a window.
"""
