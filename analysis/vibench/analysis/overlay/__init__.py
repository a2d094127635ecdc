"""The model beside the measurement: predicted responses to sines, and the same test simulated.

The specimen is simulated under the base motion that was recorded and goes through the estimators of the
measurement; the difference is in dB, and in standard errors of both. A plan's responses and collisions
are predicted before it is played. Similarity of two curves: eqs. 6 and 7 of Gong et al. 2025, whose
logarithm is a named option. Nothing is fitted here.
"""
