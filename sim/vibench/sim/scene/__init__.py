"""Solve a scene with an error estimate.

`Scene` contains specimen, drive, start, duration, observables and accuracy. `plan_scene` decides in advance
whether a closed form suffices. `solve_scene` runs the scene. It measures the integration error by a
stricter run, and the scatter between windows of chaos (docs/accuracy.md). The result, `ScenePrediction`, is
one flat frozen value. Use `study` for many scenes.
"""
