"""Whether a recorded motion is periodic, quasi-periodic or chaotic, and whether the data can say so.

A motion is its points once per drive period, with their noise. It is called chaotic only when all
witnesses agree: the 0-1 test (Gottwald & Melbourne 2009), surrogates (Kantz & Schreiber 2004), no closed
curve, far above the noise; otherwise undecided. The largest exponent from data: Rosenstein et al. 1993.
"""
