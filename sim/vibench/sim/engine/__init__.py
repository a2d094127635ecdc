"""The native engine, compiled from the C++ in native/: one source for a motion and its derivatives.

`NativeRun` follows one motion of a specimen under a harmonic drive. The library is chosen by processor and
loaded once; first it must answer a known scene (docs/decisions/0077-native-engine.md). Python prepares what
is needed once per run: modal forms, and the shapes of collisions and steps. Other drives follow.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
