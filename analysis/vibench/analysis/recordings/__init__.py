"""Common input of all analyses of a recording: three channels, facts, levels and checks.

The channels are drive, base and response, from a recording or a simulation of it, in blocks. Facts are the
measurement, its instruments, how it ended, and notes of feedback. Checks warn of problems of the recording.
The format: docs/recording-format.md.
"""
