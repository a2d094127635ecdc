"""Sines in a signal: their frequency, amplitude and phase, peaks of spectra, and orders of the drive.

The drive amplitude A0 of the paper, a base displacement [m], is computed from the recorded base acceleration.
The package also estimates the bias of a maximum due to noise.
"""
