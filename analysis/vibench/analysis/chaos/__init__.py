"""Classify a recorded motion as periodic, quasi-periodic, chaotic or undecided.

The input is one point per drive period, with its noise. A motion is called chaotic only when all tests
agree: the 0-1 test (Gottwald & Melbourne 2009), surrogates (Kantz & Schreiber 2004), no closed
curve, far above the noise; otherwise undecided. The largest exponent from data: Rosenstein et al. 1993.
"""
