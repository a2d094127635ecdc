"""Sines in a signal: their frequency, amplitude and phase, peaks of spectra, and orders of the drive.

The drive amplitude A0 of the paper, a base displacement [m], comes from the recorded base acceleration. The
bias of a maximum by noise is estimated too.
"""
