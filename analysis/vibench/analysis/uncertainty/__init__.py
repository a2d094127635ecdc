"""Uncertainty budgets: contributions of calibration, clock, converter, alignment, noise and chance.

Standard uncertainties are combined as in the GUM (JCGM 100:2008, 5.1). Causes that the hardware
configuration does not state are reported as not stated and never taken as zero.
"""
