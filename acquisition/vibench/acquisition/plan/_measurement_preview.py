"""Preview of a measurement: signal, loads and limits, duration, size of the recording."""

from dataclasses import dataclass

import numpy as np

from vibench.sim.branches import least_growth_time_s

from ..excitation.kinds import EXCITATION_KINDS, Excitation
from ..excitation.plan import SignalPreview
from ..instruments import Samples
from ..rig import Rig
from ._campaign import BYTES_PER_SAMPLE
from ._limits import LimitCheck, limit_checks
from ._schedule import DriveSource, Measurement, drive_source_of, duration_s, loop_time_s

MOST_SAMPLES = 1_000_000
"""Largest number of displayed samples of the signal; a long sweep is displayed at a lower sample rate."""
SPECTRUM_POINTS = 4000
_LOWEST_RATE = 2.1
"""Smallest number of displayed samples per period at the highest frequency."""


@dataclass(frozen=True, eq=False)
class MeasurementPreview:
    """Predictions for a measurement on a rig, made without using its instruments."""

    measurement: Measurement
    volts: Samples
    """Signal as set at the generator's panel, shape (samples,) [V]."""
    sample_rate_hz: float
    spectrum_hz: Samples
    """Frequency of the strongest spectral line in each of at most `SPECTRUM_POINTS` intervals [Hz]."""
    spectrum_v: Samples
    """Peak amplitude of the sine at each of ``spectrum_hz`` [V]."""
    rms_v: float
    peak_v: float
    checks: tuple[LimitCheck, ...]
    """Limit checks, sorted by the used fraction of the limit, the largest first."""
    duration_s: float
    """Duration from the start of the first ramp to the end of the last ramp [s]."""
    size_bytes: int
    """Size of the recording while it grows [bytes]."""
    least_growth_time_s: float | None
    """Shortest growth time (by a factor of e) of an unstable motion that feedback can hold [s], if known."""

    @property
    def is_allowed(self) -> bool:
        """Whether the limits of the rig allow the measurement."""
        return not any(check.forbids for check in self.checks)


def preview_signal(excitation: Excitation, rig: Rig) -> tuple[SignalPreview, float]:
    """Return the signal and its sample rate [Hz]; raises ConfigurationError when it cannot be sampled."""
    affordable = MOST_SAMPLES / max(excitation.playing_s, 1.0)
    rate_hz = max(min(rig.daq.sample_rate_hz, affordable), _LOWEST_RATE * excitation.highest_frequency_hz)
    return excitation.preview(rate_hz), rate_hz


def preview_measurement(measurement: Measurement, rig: Rig) -> MeasurementPreview:
    """Return the preview of a measurement; raises ConfigurationError when the signal cannot be sampled."""
    preview, rate_hz = preview_signal(measurement.excitation, rig)
    spectrum_hz, spectrum_v = _highest_lines(preview)
    length_s = duration_s(measurement)
    checks = sorted(limit_checks(measurement, rig), key=lambda check: check.use, reverse=True)
    return MeasurementPreview(
        measurement=measurement,
        volts=preview.volts.astype(np.float32),
        sample_rate_hz=rate_hz,
        spectrum_hz=spectrum_hz,
        spectrum_v=spectrum_v,
        rms_v=preview.rms_v,
        peak_v=preview.peak_v,
        checks=tuple(checks),
        duration_s=length_s,
        least_growth_time_s=_least_growth_time_s(measurement, rig),
        size_bytes=round(length_s * rig.daq.sample_rate_hz) * len(rig.daq.channels) * BYTES_PER_SAMPLE,
    )


def _least_growth_time_s(measurement: Measurement, rig: Rig) -> float | None:
    excitation = measurement.excitation
    if not EXCITATION_KINDS[excitation.kind].is_feedback:
        return None
    if drive_source_of(measurement, rig) is DriveSource.CONTROLLER:
        # Which motions a real-time loop can hold depends on gains and plant: `require_holdable`.
        return None
    return least_growth_time_s(loop_time_s(rig, excitation.band_hz[0]))


def _highest_lines(preview: SignalPreview) -> tuple[Samples, Samples]:
    """Return frequency and amplitude of the strongest spectral line of each logarithmic interval."""
    frequency_hz, amplitude_v = preview.frequency_hz[1:], preview.spectrum_v[1:]
    if len(frequency_hz) <= SPECTRUM_POINTS:
        return frequency_hz, amplitude_v
    edges = np.geomspace(frequency_hz[0], frequency_hz[-1], SPECTRUM_POINTS)
    starts = np.unique(np.searchsorted(frequency_hz, edges))
    ends = np.append(starts[1:], len(frequency_hz))
    lines = [int(first + np.argmax(amplitude_v[first:end])) for first, end in zip(starts, ends, strict=True)]
    return frequency_hz[lines], amplitude_v[lines]
