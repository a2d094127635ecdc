"""A specimen as plain numbers, and the places of the state vector that every kernel advances in place."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
