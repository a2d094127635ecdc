"""Spectra of long signals: densities with confidence bounds, amplitude spectra, spectrograms.

Records arrive block by block, and memory does not grow with them. Segments that touch lost samples are left
out and counted. An amplitude spectrum shows the amplitude of a sine.
"""
