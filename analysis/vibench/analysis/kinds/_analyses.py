"""The row of each kind of excitation."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from ._analysis_kind import AnalysisKind
from ._dwell import DWELL
from ._noise import REPEATED_NOISE, STREAMED_NOISE
from ._stepped import RESONANCE_TRACKING, SETTLED_SINE, STEPPED_LEVEL, STEPPED_SINE
from ._sweep import SWEEP

ANALYSES: Mapping[str, AnalysisKind[Any, Any, Any]] = MappingProxyType(
    {
        "multisine_noise": REPEATED_NOISE,
        "odd_multisine": REPEATED_NOISE,
        "streamed_noise": STREAMED_NOISE,
        "sine_sweep": SWEEP,
        "held_sweep": SWEEP,
        "dwell": DWELL,
        "held_dwell": DWELL,
        "stepped_sine": STEPPED_SINE,
        "settled_sine": SETTLED_SINE,
        "stepped_level": STEPPED_LEVEL,
        "resonance_tracking": RESONANCE_TRACKING,
    }
)
"""By the word in a plan; families in the order in which a report shows them."""
