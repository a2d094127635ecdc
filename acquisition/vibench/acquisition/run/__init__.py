"""Carrying out one measurement: check at low level, ramp, settle, record, ramp down, silence.

A run is a state machine that yields progress after every block. Samples read are its only clock; each
block is checked against the limits of the rig (docs/decisions/0024-limits-while-running.md) and goes to the
recording without a gap. Whatever fails, the drive is silenced and the recording says how it ended. A
generator and an analogue output are driven alike (`Drive`). It knows one measurement, no campaign.
"""
