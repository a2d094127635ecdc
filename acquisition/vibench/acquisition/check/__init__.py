"""Check of a bench before it is armed: silence, a small sine, silence again, and drift.

Findings compare noise, gains, signs, clocks and identities with the configuration and with the last check,
stored in the user's state folder. A bench is admitted if a recent check of the same configuration passed.
"""
