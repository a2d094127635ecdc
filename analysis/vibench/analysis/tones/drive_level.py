"""The drive amplitude A0 of the paper: base displacement, from the recorded base acceleration."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..signals.arrays import Reals
from ..signals.confidence import standard_uncertainty
from ..signals.quantity import Quantity, derivative_factor
from ..spectra.spectra import SpectralDensity
from .order_tracking import tracked_orders
from .sine_fit import fitted_sine, steady_phase

_SCATTER_BLOCKS = 10
"""Parts of the window whose scatter gives the uncertainty: it holds whatever moves, not only noise."""
_ORDERS = (1.0, 2.0, 3.0)


@dataclass(frozen=True)
class DriveLevel:
    """How hard the base was driven by a sine."""

    frequency_hz: float
    sd_frequency_hz: float
    """By the converter's clock, measured on the drive channel."""
    phase_rad: float
    """Of the drive voltage, as a cosine, at the first sample."""
    amplitude_m: float
    """A0: displacement amplitude of the base at the drive frequency [m]."""
    sd_amplitude_m: float
    distortion: float
    """Displacement amplitudes of orders 2 and 3 over that of order 1."""


@dataclass(frozen=True)
class NoiseDriveLevel:
    """How hard the base was driven by noise, within a band."""

    OWN_UNITS: ClassVar = {"rms_acceleration": "m s-2"}

    low_hz: float
    high_hz: float
    rms_acceleration: float
    """[m/s2]."""
    rms_displacement_m: float
    relative_sd: float
    """Of both, from the number of independent averages and lines."""


def drive_level(drive: Reals, base: Reals, sample_rate_hz: float, *, near_hz: float) -> DriveLevel:
    """Measure A0 of a dwell from drive voltage and base acceleration [m/s2], each of shape (samples,)."""
    sine = fitted_sine(drive, sample_rate_hz, near_hz)
    phase = steady_phase(base.size, sine.frequency_hz / sample_rate_hz, sine.phase_rad)
    whole = tracked_orders(base, phase, interval_samples=base.size, orders=_ORDERS)
    parts = tracked_orders(base, phase, interval_samples=base.size // _SCATTER_BLOCKS, orders=_ORDERS)
    omega = 2 * np.pi * sine.frequency_hz
    scatter = standard_uncertainty(np.abs(parts.order(1.0)))
    displacement = whole.amplitude[:, 0] / (omega * np.asarray(_ORDERS)) ** 2
    return DriveLevel(
        frequency_hz=sine.frequency_hz,
        sd_frequency_hz=sine.sd_frequency_hz,
        phase_rad=sine.phase_rad,
        amplitude_m=float(displacement[0]),
        sd_amplitude_m=scatter / omega**2,
        distortion=float(np.hypot(displacement[1], displacement[2]) / displacement[0]),
    )


def noise_drive_level(density: SpectralDensity, *, low_hz: float, high_hz: float) -> NoiseDriveLevel:
    """Measure how hard noise drove the base: rms of acceleration and displacement in a band.

    Parameters
    ----------
    density
        Of the base acceleration [(m/s2)^2 / Hz].
    low_hz, high_hz
        The band.

    """
    kept = (density.frequency_hz >= low_hz) & (density.frequency_hz <= high_hz) & (density.frequency_hz > 0)
    factor = np.abs(
        derivative_factor(density.frequency_hz[kept], Quantity.ACCELERATION, Quantity.DISPLACEMENT)
    )
    spacing_hz = density.sample_rate_hz / density.segment_samples
    power = density.density[kept] * spacing_hz
    # Lines within one noise bandwidth say the same; the rms has half the relative spread of the power.
    lines = np.count_nonzero(kept) / (density.noise_bandwidth_hz / spacing_hz)
    return NoiseDriveLevel(
        low_hz=low_hz,
        high_hz=high_hz,
        rms_acceleration=float(np.sqrt(np.sum(power))),
        rms_displacement_m=float(np.sqrt(np.sum(power * factor**2))),
        relative_sd=float(0.5 / np.sqrt(density.n_eff * max(1.0, lines))),
    )
