"""What the generator plays: a frozen plan for each kind of excitation, and a table of the kinds.

A plan lists its steps (tone, waveform of the generator's memory, stream of an analogue output) with the
segments that name them in the recording. Amplitudes are settings, peak to peak at the terminal [V]; plans
with feedback name a level of the base instead. Knows no rig: what a plan does to one is said in `plan`.
"""

from ._dwell import (
    LEAD_IN_LABEL,
    MOST_LEAD_INS,
    Dwell,
    LeadIn,
)
from ._feedback import (
    BaseLevel,
    Settling,
)
from ._held_dwell import (
    HeldDwell,
)
from ._held_sweep import (
    HeldSweep,
)
from ._kinds import (
    KINDS,
    Excitation,
)
from ._multisine import (
    held_lines,
)
from ._multisine_noise import (
    MultisineNoise,
)
from ._odd_multisine import (
    OddMultisine,
)
from ._plan import (
    LOWEST_AMPLITUDE_VPP,
    AbstractExcitation,
    AbstractFeedback,
)
from ._preview import (
    SignalPreview,
)
from ._resonance_tracking import (
    RESONANCE_LABEL,
    ResonanceTracking,
)
from ._settled_sine import (
    GLIDE_TONE_S,
    SEARCH_LABEL,
    STEP_LABEL,
    SettledSine,
)
from ._sine_sweep import (
    SineSweep,
)
from ._stepped_level import (
    SteppedLevel,
)
from ._stepped_sine import (
    Direction,
    FrequencySteps,
    SteppedSine,
)
from ._steps import (
    Play,
    Samples,
    SampleSource,
    Segment,
    Step,
    Stream,
    Tone,
    Waveform,
)
from ._streamed_noise import (
    StreamedNoise,
)

__all__ = [
    "GLIDE_TONE_S",
    "KINDS",
    "LEAD_IN_LABEL",
    "LOWEST_AMPLITUDE_VPP",
    "MOST_LEAD_INS",
    "RESONANCE_LABEL",
    "SEARCH_LABEL",
    "STEP_LABEL",
    "AbstractExcitation",
    "AbstractFeedback",
    "BaseLevel",
    "Direction",
    "Dwell",
    "Excitation",
    "FrequencySteps",
    "HeldDwell",
    "HeldSweep",
    "LeadIn",
    "MultisineNoise",
    "OddMultisine",
    "Play",
    "ResonanceTracking",
    "SampleSource",
    "Samples",
    "Segment",
    "SettledSine",
    "Settling",
    "SignalPreview",
    "SineSweep",
    "Step",
    "SteppedLevel",
    "SteppedSine",
    "Stream",
    "StreamedNoise",
    "Tone",
    "Waveform",
    "held_lines",
]
