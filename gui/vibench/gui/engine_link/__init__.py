"""The connection between the window and the engine's process.

`Bridge` requests status and samples at every tick, keeps the last answers and sends commands. A thread
without Qt waits for the answers, so that the window does not. An `Attendant` reports that the window is
alive; otherwise the engine ramps down (docs/engine.md). Each run has a `LiveView` of its newest samples.
"""
