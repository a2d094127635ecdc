"""Analyse recordings and campaigns, each recording by the excitation in its plan.

The result of a recording is a noise, sweep, dwell or stepped-sine result, with or without the model
overlaid. A recording that fails is reported with the reason; the others continue. Results are also
available as JSON, with units in the keys and an uncertainty beside each number.
"""
