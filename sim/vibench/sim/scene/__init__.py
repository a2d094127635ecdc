"""Solve a scene with an error estimate.

A `Scene` contains specimen, drive, start (initial state), duration, observables and accuracy. `plan_scene`
decides beforehand whether a closed form suffices. `solve_scene` simulates the scene, measures the integration
error by a second run with a smaller tolerance, and estimates how much chaotic responses scatter between
windows (docs/accuracy.md). The result is a `ScenePrediction`, a flat record. Use `study` for many scenes.
"""
