"""The connection between the window and the engine's process.

`Bridge` requests status and samples at every tick, keeps the newest and sends commands. A thread without
Qt waits for the answers, so that the window does not block. An `Attendant` reports that the window is alive;
without these reports the engine ramps down (docs/engine.md). A `LiveView` holds the newest samples of a run.
"""
