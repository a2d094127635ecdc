"""The native engine, compiled from the C++ in native/: motions, chains, filters, the virtual rig.

`NativeRun` integrates one motion of a specimen under a harmonic drive. The library is chosen by processor,
loaded once, and checked with a known scene (docs/decisions/0077-native-engine.md). Python prepares modal
forms and the shapes of collisions and steps. `CubicRun` integrates under a base motion of cubic polynomials
on equal intervals: sweeps and recordings.

Signals, filters and the analogue world call the engine through `native_engine`: `Engine.new` fills a
structure of native/structures.hpp, `Engine.call` passes it to a function.
"""
