"""Compare measurements with the model: predicted responses to sines, and simulations of the same test.

The simulated specimen is driven by the recorded voltage or base motion and analysed with the same estimators.
Differences are in dB and in standard errors. Responses and collisions of a plan are predicted. The similarity
of two curves follows eqs. 6 and 7 of Gong et al. 2025; the unit inside the logarithm is an option.
"""
