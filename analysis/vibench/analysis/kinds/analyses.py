"""The analysis of each kind of excitation; kinds of a family may share an analysis."""

from collections.abc import Mapping
from typing import Any

from vibench.acquisition.instruments import PlugInKind
from vibench.acquisition.plan import Family, present_word, rows_by_kind

from .analysis_kind import AnalysisKind
from .noise import REPEATED_NOISE, STREAMED_NOISE
from .sine import DWELL, RESONANCE_TRACKING, SETTLED_SINE, STEPPED_LEVEL, STEPPED_SINE, SWEEP

ANALYSES: Mapping[str, AnalysisKind[Any, Any, Any]] = rows_by_kind(
    {
        Family.NOISE: REPEATED_NOISE,
        Family.SWEEP: SWEEP,
        Family.DWELL: DWELL,
        Family.STEPPED: STEPPED_SINE,
    },
    {
        "streamed_noise": STREAMED_NOISE,
        "settled_sine": SETTLED_SINE,
        "stepped_level": STEPPED_LEVEL,
        "resonance_tracking": RESONANCE_TRACKING,
        "held_response": SETTLED_SINE,
    },
    PlugInKind.ANALYSIS,
)
"""Analyses, keyed by the kind of excitation; families are in the order of a report."""


def family_of(plan: Mapping[str, Any]) -> str:
    """Return the family of analyses of a recording's plan; empty if its kind is unknown."""
    kind = present_word((plan.get("excitation") or {}).get("kind", ""))
    return ANALYSES[kind].family if kind in ANALYSES else ""
