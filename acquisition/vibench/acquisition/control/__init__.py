"""Feedback controllers: measurements whose next step depends on what was measured.

A controller is a generator: it yields a phase to play, receives the samples of that phase, and decides the
next: settling, holding a level, stepping on one branch, locating a jump, tracking a phase resonance. It
works period by period on the recorded drive, not in real time, and uses no instrument. See
docs/decisions/0015-feedback.md and docs/feedback.md.
"""
