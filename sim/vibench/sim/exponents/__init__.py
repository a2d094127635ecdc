"""Growth of small changes: Lyapunov exponents with standard errors, and whether a motion is chaotic.

The variation is carried exactly through flight and every contact; its growth [1/s], averaged, is the
exponent, with a standard error that allows for correlation (docs/decisions/0007-lyapunov.md). A
run that comes to rest in a repeating motion gets the exponents of that motion; chaos that died out is
reported as a transient. `lyapunov_spectrum` gives all six and the Kaplan-Yorke dimension.
"""
