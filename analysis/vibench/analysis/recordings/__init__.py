"""What every analysis reads of one recording: its three channels, its facts, levels and checks.

The channels are drive, base and response, from a recording or a simulation of it; block by block.
Facts are what was measured, with what, and how it ended, with what feedback noted while it ran. Checks
say what to look at before trusting it. The format: docs/recording-format.md. Nothing is estimated here.
"""
