"""Common input of all analyses of a recording: three channels, facts, levels and checks.

The channels are drive, base and response, read in blocks from a recording or from its simulation. Facts are
the measurement, its instruments, how it ended, and notes of feedback control. Checks warn of problems in the
recording. The file format is described in docs/recording-format.md.
"""
