"""Check a bench before it is armed: in silence, with a small sine, in silence again, and for drift.

Findings compare noise, gains, signs, clocks and identities with the configuration and with the last check,
stored in the user's state folder. A bench may measure if a recent check of the same configuration passed.
"""
