"""Check of a bench before it is armed: silence, a small sine, silence again, and changes.

Findings compare noise, gains, signs, clocks and identities with the configuration and with the last check,
stored in the user's state folder. A bench is admitted by a recent passed check of the same configuration.
"""
