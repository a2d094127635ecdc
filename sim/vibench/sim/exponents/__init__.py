"""Growth of small perturbations: Lyapunov exponents with standard errors, and detection of chaos.

A small perturbation of the state is propagated exactly, through all contacts. Its mean growth rate [1/s] is
the exponent. The standard error allows for correlated growth (docs/decisions/0007-lyapunov.md). If the motion
becomes periodic, the exponent describes the periodic motion, and earlier chaos is reported as a transient.
`lyapunov_spectrum` returns all six exponents and the Kaplan-Yorke dimension.
"""
