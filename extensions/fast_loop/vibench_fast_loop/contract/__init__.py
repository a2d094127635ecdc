"""Contract tests of real-time controllers: does a driver fulfil `LoopController`?"""
