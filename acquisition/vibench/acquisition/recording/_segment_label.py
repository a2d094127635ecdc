"""Names of the stretches of a recording: given by plans and runs, looked up by analysis."""

from enum import StrEnum


class SegmentLabel(StrEnum):
    """What is played while a segment is recorded."""

    REALISATION = "realisation"
    NOISE = "noise"
    SWEEP = "sweep"
    DWELL = "dwell"
    STEP = "step"
    """A frequency of the plan's list, or a level."""
    SEARCH = "search"
    """A frequency that was added to localise a jump."""
    RESONANCE = "resonance"
    BRANCH = "branch"
    """A point of a branch that a fast loop holds."""
    PERTURBED = "perturbed"
    """Such a point while what is played is changed a little: what tells its stability."""
    CHECK = "check"
    """The small sine before the first ramp."""
    LEAD_IN = "lead_in"
    """Tones on the way to a dwell."""
    RAMP_UP = "ramp_up"
    RAMP_DOWN = "ramp_down"
