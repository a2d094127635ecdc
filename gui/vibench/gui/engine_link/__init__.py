"""The connection between the window and the engine's process.

`Bridge` asks for status and samples at every tick, keeps what was answered last and sends commands; one
thread without Qt waits for answers, so that the window never does. Its `Attendant` is fed here: an engine
that misses it ramps down (docs/engine.md). A `LiveView` of the newest samples is kept for each run.
"""
