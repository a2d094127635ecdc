"""Analyse recordings and campaigns; a recording's excitation determines its analysis.

The result of a recording is a noise, sweep, dwell or stepped-sine result, with or without an overlaid
simulation. A recording that cannot be analysed is reported with the reason; the others are still analysed.
Results are also available as JSON, with units in the keys and an uncertainty for each number.
"""
