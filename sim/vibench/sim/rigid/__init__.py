"""Impact on a rigid stop: m1 rebounds with a coefficient of restitution (Newton), or comes to rest on it.

An impact takes no time and keeps the momentum of m1 and m2. Chatter, infinitely many impacts in a finite
time, is followed while it can be told from rest and then summed; m1 is held from then on (`sticking`).
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
