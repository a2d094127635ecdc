"""Contract tests of real-time controllers; they check that a driver fulfils `LoopController`."""
