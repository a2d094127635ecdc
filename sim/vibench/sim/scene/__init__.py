"""A scene answered with its error: what is shaken, what is to be seen, how it is run, how far to trust it.

`Scene` holds specimen, drive, start, duration, observables and accuracy. `plan_scene` decides beforehand
whether a closed form suffices and what has to be carried along; `solve_scene` runs it and measures the
integration error against stricter steps and the scatter of chaotic windows (docs/accuracy.md). The answer,
`ScenePrediction`, is one flat frozen value. Many scenes at once are the business of `study`.
"""
