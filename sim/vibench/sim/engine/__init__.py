"""The native engine, compiled from C++ in native/: motions, chains, filters, virtual rig.

`NativeRun` integrates a motion of a specimen under a harmonic drive. `Accuracy` sets the error of the
integration; `Outcome` states how a run ended. The library that suits the processor is
loaded once and checked with a known scene (docs/decisions/0077-native-engine.md). Python prepares modal
forms and the tables for collisions and time steps. `CubicRun` integrates a motion under sweeps and
recordings: base motions that are cubic polynomials on equal intervals.

Signals, filters and the analogue part of the virtual rig use the engine through `native_engine`: `Engine.new`
fills a structure of native/structures.hpp; `Engine.call` passes it to a function.
"""
