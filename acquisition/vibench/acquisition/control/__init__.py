"""Feedback controllers: measurements whose next step depends on what was measured.

A controller is a Python generator. It yields a phase to play, receives its samples, and chooses the next
phase: to settle, hold a level, stay on a branch, locate a jump, or track a phase resonance. It evaluates
recorded drive periods one by one, not in real time, and it uses no instrument. See
docs/decisions/0015-feedback.md and docs/feedback.md.
"""
