"""Sampled signals: windows, envelopes, integration, interpolation, confidence bounds.

Arrays are float64 of shape (samples,). Signals are integrated and differentiated within a band in the
frequency domain; the number of disturbed samples at the ends is returned too. Bounds of averaged estimates
follow Bendat & Piersol, Random Data.
"""
