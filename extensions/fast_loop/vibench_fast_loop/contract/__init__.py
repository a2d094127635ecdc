"""Contract tests of real-time controllers: whether a driver keeps the promises of `LoopController`."""
