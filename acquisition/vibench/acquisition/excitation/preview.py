"""What an excitation will look like, before anything moves: time signal, spectrum and its key figures."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..errors import ConfigurationError
from ..instruments import Sweep
from .steps import Play, Samples, Step, Stream, Tone, Waveform


@dataclass(frozen=True, eq=False)
class SignalPreview:
    """The voltage that the generator's panel promises, as samples and in figures."""

    time_s: Samples
    """Shape (samples,) [s]."""
    volts: Samples
    """Shape (samples,) [V]."""
    frequency_hz: Samples
    """Shape (samples // 2 + 1,) [Hz]."""
    spectrum_v: Samples
    """Amplitude of the sine at each frequency, peak [V]; shape of ``frequency_hz``."""
    rms_v: float
    peak_v: float
    duration_s: float
    """Time that the whole excitation takes, settling included, ramps not [s]."""

    @property
    def crest_factor(self) -> float:
        """Peak over rms."""
        return self.peak_v / self.rms_v


def signal_preview(
    steps: Iterable[Step],
    amplitude_vpp: float,
    sample_rate_hz: float,
    highest_frequency_hz: float,
    duration_s: float,
) -> SignalPreview:
    """Sample ``steps`` one after the other; a tone takes up the phase where the one before it ended."""
    if sample_rate_hz <= 2 * highest_frequency_hz:
        raise ConfigurationError(
            f"a preview at {sample_rate_hz:g} samples/s cannot show {highest_frequency_hz:g} Hz; "
            f"ask for more than {2 * highest_frequency_hz:g} samples/s"
        )
    volts = 0.5 * amplitude_vpp * _sampled(steps, sample_rate_hz)
    one_sided = np.abs(np.fft.rfft(volts)) * 2 / len(volts)
    one_sided[0] /= 2
    if len(volts) % 2 == 0:
        one_sided[-1] /= 2
    return SignalPreview(
        time_s=np.arange(len(volts)) / sample_rate_hz,
        volts=volts,
        frequency_hz=np.asarray(np.arange(len(one_sided)) * sample_rate_hz / len(volts), dtype=np.float64),
        spectrum_v=one_sided,
        rms_v=float(np.sqrt(np.mean(volts**2))),
        peak_v=float(np.max(np.abs(volts))),
        duration_s=duration_s,
    )


def _sampled(steps: Iterable[Step], sample_rate_hz: float) -> Samples:
    pieces: list[Samples] = []
    elapsed_s = 0.0
    first = 0
    cycles = 0.0
    for step in steps:
        end_s = elapsed_s + step.duration_s
        last = round(end_s * sample_rate_hz)
        since_s = np.arange(first, last) / sample_rate_hz - elapsed_s
        pieces.append(_values(step.play, since_s, first, sample_rate_hz, cycles))
        cycles = (cycles + _cycles_of(step.play) * step.duration_s) % 1.0
        elapsed_s, first = end_s, last
    return np.concatenate(pieces)


def _values(play: Play, since_s: Samples, first: int, sample_rate_hz: float, cycles: float) -> Samples:
    match play:
        case Sweep():
            return np.asarray(np.sin(2 * np.pi * (play.cycles(since_s) + cycles)))
        case Tone(frequency_hz, level):
            return np.asarray(level * np.sin(2 * np.pi * (frequency_hz * since_s + cycles)))
        case Waveform(values, repetition_hz):
            # A sample that falls on the edge between two held values belongs to the later one: the
            # small shift keeps rounding from handing it to the earlier one.
            edge = 1e-9
            position = np.floor(since_s * repetition_hz * len(values) + edge).astype(np.int64)
            return np.asarray(values[position % len(values)])
        case Stream(source):
            return source.samples(first, len(since_s), sample_rate_hz)


def _cycles_of(play: Play) -> float:
    match play:
        case Tone(frequency_hz, _):
            return frequency_hz
        case Sweep():
            return play.cycles(play.duration_s) / play.duration_s
        case Waveform() | Stream():
            return 0.0
