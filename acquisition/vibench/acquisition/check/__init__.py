"""The check of a bench before it is armed: silence, a small sine, silence again, and what has changed.

Findings compare noise, gains, signs, clocks and identities with the configuration and with the last
check, which is kept in the user's state folder; a bench is admitted on a check that is recent, passed and
of the same configuration. Knows no campaign.
"""
