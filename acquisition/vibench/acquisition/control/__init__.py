"""Feedback controllers: measurements whose next step depends on what was measured.

A controller is a Python generator. It yields a phase to play, receives the samples of that phase, and chooses
the next phase: to settle, hold a level, stay on a branch, locate a jump, or track a phase resonance. The
controller evaluates recorded drive periods one by one, not in real time, and uses no instrument. See
docs/decisions/0015-feedback.md and docs/feedback.md.
"""
