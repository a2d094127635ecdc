"""Growth of small changes: Lyapunov exponents with standard errors, and whether a motion is chaotic.

A small change of the state is propagated exactly through flight and every contact. Its mean growth rate
[1/s] is the exponent, with a standard error that allows for correlation (docs/decisions/0007-lyapunov.md). If
the motion becomes periodic, the exponent is that of the periodic motion; chaos before it is reported as a
transient. `lyapunov_spectrum` gives all six and the Kaplan-Yorke dimension.
"""
