"""One mode of a transmission, and what a fit of it may give."""

from dataclasses import dataclass
from typing import ClassVar

SMALLEST_RELATIVE_SD = 1e-6
"""Keeps the weights finite where a noise-free simulation states no spread at all."""
LARGEST_DAMPING = 0.5
RESOLVED_LINES = 4.0
"""Noise bandwidths that a half-power bandwidth must hold to be resolved."""
WELL_FITTED = 1.2
"""Reduced chi-square at which the background is good enough: a higher degree would only widen the spreads."""


@dataclass(frozen=True)
class Resonance:
    """One resonance, from the fit of all modes of a band, or of this one on a smooth background."""

    DOCUMENT: ClassVar = (
        "frequency_hz sd_frequency_hz damping_ratio sd_damping_ratio peak_frequency_hz peak_magnitude "
        "sd_peak_magnitude reduced_chi_square chi_square_limit remark is_resolved"
    )

    frequency_hz: float
    """Undamped natural frequency of the mode."""
    sd_frequency_hz: float
    damping_ratio: float
    sd_damping_ratio: float
    peak_frequency_hz: float
    """Where the fitted magnitude is largest."""
    peak_magnitude: float
    sd_peak_magnitude: float
    reduced_chi_square: float
    """Misfit about the mode over what the lines' scatter explains; spreads are widened when it is above 1."""
    chi_square_limit: float
    """What one right fit in a thousand exceeds."""
    lines_used: int
    is_resolved: bool
    """Whether the lines are fine enough for this bandwidth."""

    @property
    def is_explained(self) -> bool:
        """Whether the fitted modes describe the lines about this one, within their scatter."""
        return self.reduced_chi_square <= max(self.chi_square_limit, WELL_FITTED)

    @property
    def remark(self) -> str:
        """Sentence about a fit that does not describe its lines; empty where it does."""
        if self.is_explained:
            return ""
        return (
            f"one mode does not describe the lines near {self.frequency_hz:.5g} Hz (reduced chi² = "
            f"{self.reduced_chi_square:.3g}, at most {max(self.chi_square_limit, WELL_FITTED):.3g} by chance)"
        )

    @property
    def quality_factor(self) -> float:
        """1 / (2 damping ratio)."""
        return 0.5 / self.damping_ratio

    @property
    def sd_quality_factor(self) -> float:
        """Standard deviation of the quality factor."""
        return self.quality_factor * self.sd_damping_ratio / self.damping_ratio

    @property
    def half_power_bandwidth_hz(self) -> float:
        """2 damping ratio times frequency."""
        return 2 * self.damping_ratio * self.frequency_hz

    @property
    def sd_half_power_bandwidth_hz(self) -> float:
        """Standard deviation of the half-power bandwidth."""
        return self.half_power_bandwidth_hz * self.sd_damping_ratio / self.damping_ratio
