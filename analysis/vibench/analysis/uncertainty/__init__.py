"""Budgets of uncertainty: what calibration, clock, converter, alignment, noise and chance add to a result.

Standard uncertainties are combined as the GUM (JCGM 100:2008, 5.1) does; what a hardware configuration does
not state is named as not stated, and never taken as zero.
"""
