"""Solve a scene with an error estimate.

`Scene` contains specimen, drive, start, duration, observables and accuracy. `plan_scene` decides in advance
whether a closed form suffices. `solve_scene` simulates the scene, measures the integration error by a
stricter run, and estimates the scatter between windows of chaos (docs/accuracy.md). It returns a
`ScenePrediction`, a flat, immutable record. Use `study` for many scenes.
"""
