"""Whether a recorded motion is periodic, quasi-periodic or chaotic, and whether the data can say so."""
