"""m1 resting on a rigid stop: exact motion until the contact force reaches zero; lift-off.

Release is found like a touch, by the proof of `flight`, from the acceleration that presses m1 on the stop.
After lift-off the gap grows from nothing, so that the first moment of the flight is bounded instead of
searched.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
