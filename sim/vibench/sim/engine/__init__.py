"""The native engine, compiled from the C++ in native/: motions, chains, filters, the virtual rig.

`NativeRun` follows one motion of a specimen under a harmonic drive. The library is chosen by processor and
loaded once; first it must answer a known scene (docs/decisions/0077-native-engine.md). Python prepares what
is needed once per run: modal forms, and the shapes of collisions and steps. `CubicRun` follows a base that is
a cubic polynomial on each of equal intervals: sweeps and recordings.

Signals, filters and the analogue world call it through `native_engine`: `Engine.new` fills a structure of
native/structures.hpp, `Engine.call` hands it over.
"""
