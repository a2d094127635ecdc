"""Classify a recorded motion as periodic, quasi-periodic, chaotic or undecided.

The input is one point (displacement, velocity) per drive period, with its noise. A motion is chaotic only if
all tests agree: the 0-1 test (Gottwald & Melbourne 2009), surrogates (Kantz & Schreiber 2004), points on no
closed curve, and scatter far above the noise. The largest exponent is estimated as in Rosenstein et al. 1993.
"""
