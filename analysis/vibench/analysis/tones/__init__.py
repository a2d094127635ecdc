"""Sines in a signal: their frequency, amplitude and phase, peaks of spectra, and orders of the drive.

The drive amplitude A0 of the paper, base displacement [m], from the recorded base acceleration, and the
bias of a maximum by noise.
"""
