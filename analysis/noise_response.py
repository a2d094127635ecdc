"""What a noise measurement shows: the transmission from base to m0, with bounds and resonances."""

from dataclasses import dataclass, replace

import numpy as np

from acquisition.excitation.multisine_noise import MultisineNoise
from acquisition.excitation.odd_multisine import OddMultisine
from acquisition.excitation.streamed_noise import StreamedNoise

from .arrays import Complexes, Reals
from .confidence import DEFAULT_CONFIDENCE, relative_sd, student_half_width
from .drive_level import NoiseDriveLevel, noise_drive_level
from .errors import NotEnoughData
from .estimators import coherence, h1, h2
from .periodic_transmission import PeriodicSums, PeriodicTransmission
from .quantity import Quantity, converted_transmission
from .recorded_channels import Channels, Stretch, only_stretch
from .repetition import period_spectra
from .resonance import Resonance, resonances
from .results import Estimator, Transmission
from .transmission import TransmissionSums

Noise = MultisineNoise | OddMultisine | StreamedNoise

_SEGMENT_S = 4.0
"""Segment of streamed noise: a quarter of a hertz between lines resolves a bandwidth of 1 Hz."""
_LEAST_SEGMENTS = 8
"""A short record gets shorter segments rather than fewer averages than this."""
_BLOCK_SEGMENTS = 4
_LEVEL_SEGMENT_S = 1.0
_LEAST_PERIODS = 2


@dataclass(frozen=True)
class NoiseResponse:
    """Transmission of base displacement to m0's displacement, and what was found in it."""

    transmission: Transmission
    """The estimate to use: referenced to the drive voltage, so that noise on no channel biases it."""
    h1: Transmission
    h2: Transmission
    resonances: tuple[Resonance, ...]
    base_level: NoiseDriveLevel
    periodic: PeriodicTransmission | None
    """Where the scatter comes from; None for noise that does not repeat."""
    used_s: float
    """Length of what was averaged [s]."""
    left_out: int
    """Realisations or segments that were cut short or touch lost or overloaded samples."""


def noise_response(channels: Channels, noise: Noise) -> NoiseResponse:
    """Estimate the transmission of a noise measurement from everything usable in it.

    Raises
    ------
    NotEnoughData
        When no realisation, or less than two segments, is left.

    """
    match noise:
        case StreamedNoise():
            return _streamed(channels, noise)
        case MultisineNoise() | OddMultisine():
            return _repeated(channels, noise)


def _repeated(channels: Channels, noise: MultisineNoise | OddMultisine) -> NoiseResponse:
    rate = channels.sample_rate_hz
    sums = PeriodicSums(rate, noise.repetition_hz)
    means: list[Complexes] = []
    base: list[Reals] = []
    stretches = channels.stretches("realisation")
    for stretch in stretches:
        data = _usable(channels, stretch, rate / noise.repetition_hz)
        if data is None:
            continue
        sums.add(*data)
        base.append(data[1])
        means.append(_mean_spectra(data, rate / noise.repetition_hz))
    if not base:
        raise NotEnoughData(
            f"none of the {noise.realisations} planned realisations of noise was recorded with two whole "
            f"periods of {1 / noise.repetition_hz:g} s; measure again"
        )
    periodic = sums.transmission(
        delay_s=channels.response_delay_s, band_hz=(noise.band_start_hz, noise.band_stop_hz)
    )
    displacements = as_displacements(periodic.transmission)
    order = np.rint(periodic.transmission.frequency_hz / noise.repetition_hz).astype(int)
    motion = np.stack([each[:, order] for each in means])
    return NoiseResponse(
        transmission=displacements,
        h1=_least_squares(periodic.transmission, motion, Estimator.H1, channels.response_delay_s),
        h2=_least_squares(periodic.transmission, motion, Estimator.H2, channels.response_delay_s),
        resonances=_resonances(displacements),
        base_level=_level(np.concatenate(base), rate, noise),
        periodic=periodic,
        used_s=sum(each.size for each in base) / rate,
        left_out=len(stretches) - len(base),
    )


def _usable(channels: Channels, stretch: Stretch, period_samples: float) -> Reals | None:
    """Read a realisation that holds two whole periods or more and no hole; else None."""
    shortfall = 1e-3
    periods = int(stretch.samples / period_samples + shortfall)
    if periods < _LEAST_PERIODS:
        return None
    data = channels.read(stretch.start, stretch.stop)
    return None if np.isnan(data).any() else data


def _mean_spectra(data: Reals, nominal_period: float) -> Complexes:
    """Spectra of base and response averaged over the periods, shape (2, lines).

    The nominal period will do for the magnitudes h1 and h2 are formed of: 20 ppm lose 2e-5 of a line.
    """
    periods = int(data.shape[1] / nominal_period + 1e-3)
    return np.stack([period_spectra(each, nominal_period, periods).mean(axis=0) for each in data[1:]])


def _least_squares(
    like: Transmission, motion: Complexes, estimator: Estimator, delay_s: float
) -> Transmission:
    """h1 or h2 over realisations; ``motion`` has the shape (realisations, 2, lines)."""
    s_xx = np.sum(np.abs(motion[:, 0]) ** 2, axis=0)
    s_yy = np.sum(np.abs(motion[:, 1]) ** 2, axis=0)
    s_xy = np.sum(np.conj(motion[:, 0]) * motion[:, 1], axis=0)
    value = h1(s_xx, s_xy) if estimator is Estimator.H1 else h2(s_yy, s_xy)
    agreement = coherence(s_xx, s_yy, s_xy)
    spread = relative_sd(np.maximum(agreement, np.finfo(float).tiny), like.n_eff)
    result = replace(
        like,
        value=value,
        coherence=agreement,
        relative_sd_magnitude=spread,
        sd_phase_rad=spread,
        half_width=student_half_width(spread, like.n_eff, DEFAULT_CONFIDENCE),
        settings=replace(like.settings, estimator=estimator, delay_s=0.0),
    )
    return as_displacements(result.without_delay(delay_s))


def _streamed(channels: Channels, noise: StreamedNoise) -> NoiseResponse:
    rate = channels.sample_rate_hz
    stretch = only_stretch(channels, "noise")
    segment = min(round(_SEGMENT_S * rate), 2 * stretch.samples // (_LEAST_SEGMENTS + 1))
    if segment < round(rate / noise.band_start_hz):
        raise NotEnoughData(
            f"{stretch.samples / rate:.3g} s of noise were recorded; {_LEAST_SEGMENTS} segments that each "
            f"hold a period of {noise.band_start_hz:g} Hz need more: measure longer"
        )
    estimators = (Estimator.DRIVE, Estimator.H1, Estimator.H2)
    sums = [TransmissionSums(rate, segment_samples=segment, estimator=each) for each in estimators]
    base = np.empty(stretch.samples)
    for first in range(stretch.start, stretch.stop, _BLOCK_SEGMENTS * segment):
        last = min(first + _BLOCK_SEGMENTS * segment, stretch.stop)
        drive, motion, response = channels.read(first, last)
        valid = np.isfinite(motion) & np.isfinite(response)
        base[first - stretch.start : last - stretch.start] = motion
        rows = np.nan_to_num(np.stack((motion, response, drive)))
        for each in sums:
            each.add(rows if each is sums[0] else rows[:2], valid)
    band = (noise.band_start_hz, noise.band_stop_hz)
    referenced, first_kind, second_kind = (
        as_displacements(each.transmission().without_delay(channels.response_delay_s).between(*band))
        for each in sums
    )
    return NoiseResponse(
        transmission=referenced,
        h1=first_kind,
        h2=second_kind,
        resonances=_resonances(referenced),
        base_level=_level(base, rate, noise),
        periodic=None,
        used_s=stretch.samples / rate,
        left_out=referenced.segments_excluded,
    )


def as_displacements(transmission: Transmission) -> Transmission:
    """Turn m0 velocity over base acceleration into displacement over displacement."""
    return converted_transmission(
        transmission,
        drive=(Quantity.ACCELERATION, Quantity.DISPLACEMENT),
        response=(Quantity.VELOCITY, Quantity.DISPLACEMENT),
    )


def _resonances(transmission: Transmission) -> tuple[Resonance, ...]:
    low, high = float(transmission.frequency_hz[0]), float(transmission.frequency_hz[-1])
    return resonances(transmission, low_hz=low, high_hz=high)


def _level(base: Reals, rate: float, noise: Noise) -> NoiseDriveLevel:
    valid = np.isfinite(base)
    return noise_drive_level(
        np.nan_to_num(base),
        rate,
        low_hz=noise.band_start_hz,
        high_hz=noise.band_stop_hz,
        segment_samples=min(round(_LEVEL_SEGMENT_S * rate), base.size),
        valid=valid,
    )
