"""Run one measurement: check at low level, ramp, settle, record, ramp down, silence.

A run is a state machine that yields progress after every block. The number of samples read is the only clock.
Each block is checked against the limits of the rig (docs/decisions/0024-limits-while-running.md) and recorded
without a gap. After any failure the drive is silenced, and the recording states how the run ended. Generators
and analogue outputs have a common interface, `Drive`.
"""
