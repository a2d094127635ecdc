"""Free motion between contacts: exact, with proof of the instant at which a stop is touched.

A touch is excluded or found by a bound on the acceleration of p, never by sampling
(docs/decisions/0004-contact-integration.md). Holds for every law but power laws, which act at every p.
"""
