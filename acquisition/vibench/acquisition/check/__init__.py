"""The check of a bench before it is armed: silence, a small sine, silence again, and what has changed.

Findings compare noise, gains, signs, clocks and identities with the configuration and with the last
check, which is kept in the user's state folder; a bench is admitted on a check that is recent, passed and
of the same configuration. Knows no campaign.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
