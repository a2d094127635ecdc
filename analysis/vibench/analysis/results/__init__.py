"""Recordings and campaigns analysed, each by the excitation that its plan names.

A recording becomes a noise, sweep, dwell or stepped-sine result, with the model overlaid on it or not; one
that cannot be analysed says why and stops no other. A result is also one JSON document, every number
with its unit in its name and its uncertainty beside it, and the curves of a comparison.
"""
