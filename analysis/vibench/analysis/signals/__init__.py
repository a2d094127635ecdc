"""Sampled signals, whatever they are of: windows, envelopes, integration, interpolation, confidence.

Arrays are float64 of shape (samples,). Integration and differentiation work in a band of the frequency
domain; what the missing past and future disturb at the ends is counted and given with the signal.
Bounds of averaged estimates follow Bendat & Piersol, Random Data. No recording is known here.
"""
