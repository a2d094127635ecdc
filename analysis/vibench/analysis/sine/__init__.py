"""Measurements under a sine: sweeps, dwells, stepped sines, tracked resonances.

Responses I and II (the paper's), their phase and orders, where the masses collide, where a response
jumps and hysteresis between up and down, the motion once per drive period and the verdict on it,
what moved to the bands of the bound modes (terminal resonances), and what feedback found (docs/feedback.md).
"""

from ._collision_region import (
    CollisionRegion,
    Collisions,
    Edge,
    collisions,
)
from ._dwell import (
    DwellResponse,
    dwell_response,
)
from ._dwell_analysis import (
    DwellAnalysis,
    bound_frequencies_hz,
    measured_dwell,
    settled_envelope,
)
from ._dwell_motion import DwellMotion, dwell_motion
from ._hysteresis import (
    Hysteresis,
    hysteresis,
)
from ._jumps import (
    Jump,
    jumps,
)
from ._level_jumps import (
    hysteresis_vpp,
    level_jumps,
    level_summary,
)
from ._stepped_response import (
    SteppedResponse,
    SteppedSineAnalysis,
    Steps,
    step_label,
    stepped_response,
)
from ._sweep import SweepResponse, SweepSums
from ._sweep_analysis import (
    SweepAnalysis,
    measured_sweep,
    smooth_jumps,
)
from ._terminal_level import (
    TerminalLevel,
    terminal_levels,
)
from ._tracked_resonance import (
    TrackedResonance,
    backbone_sentence,
    feedback_sentences,
    lost_levels,
    noted_jumps,
    tracked_resonances,
)

__all__ = [
    "CollisionRegion",
    "Collisions",
    "DwellAnalysis",
    "DwellMotion",
    "DwellResponse",
    "Edge",
    "Hysteresis",
    "Jump",
    "SteppedResponse",
    "SteppedSineAnalysis",
    "Steps",
    "SweepAnalysis",
    "SweepResponse",
    "SweepSums",
    "TerminalLevel",
    "TrackedResonance",
    "backbone_sentence",
    "bound_frequencies_hz",
    "collisions",
    "dwell_motion",
    "dwell_response",
    "feedback_sentences",
    "hysteresis",
    "hysteresis_vpp",
    "jumps",
    "level_jumps",
    "level_summary",
    "lost_levels",
    "measured_dwell",
    "measured_sweep",
    "noted_jumps",
    "settled_envelope",
    "smooth_jumps",
    "step_label",
    "stepped_response",
    "terminal_levels",
    "tracked_resonances",
]
