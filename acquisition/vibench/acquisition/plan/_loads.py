"""What a plan will do to the rig, before anything moves: peaks through the rig's linear model.

The generator's setting that a level of the base needs, by the rig's linear model.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..excitation import Excitation, Play, SampleSource, Stream, Tone, Waveform, held_lines
from ..rig import BaseQuantity, ComplexArray, Rig, RigModel

HELD_SPANS = 4
"""A held waveform is followed to twice its playback rate: the images above are below 1/20 of the band
and the table answers them ever less."""
BAND_POINTS = 2000
"""Frequencies over which the mean square of streamed noise is summed."""

Transfer: TypeAlias = Callable[[NDArray[np.float64]], ComplexArray]
"""Phasor of a quantity per volt at the generator's terminal, by frequency [Hz]."""


@dataclass(frozen=True)
class Load:
    """The largest a quantity becomes while a plan plays."""

    peak: float
    """SI unit of the quantity."""
    rms: float
    """Over the worst steady stretch; SI unit of the quantity."""
    cause: str
    """What in the plan does it: ``"at 150 Hz"``."""


def predicted_loads(excitation: Excitation, rig: Rig) -> dict[BaseQuantity, Load]:
    """Peak and rms of every quantity of the rig while ``excitation`` plays, steady state.

    Exact for the linear model: by frequency for sines, by Fourier lines summed in time for periodic
    waveforms (the images of the generator's hold included). Streamed noise is Gaussian: its peak is
    taken as its own crest factor times the rms value. Ramps stay below by their half-cosine shape.
    """
    terminal_v = terminal_volts(excitation, rig)
    model = RigModel(rig)
    tones, waveforms, sources = plays_of(excitation)

    def worst(quantity: BaseQuantity) -> Load:
        transfer = partial(model.transfer, quantity)
        loads = [_of_tones(transfer, tones)] if tones else []
        loads += [of_waveform(transfer, each, number) for number, each in enumerate(waveforms)]
        loads += [of_source(transfer, each) for each in sources]
        per_volt = max(loads, key=lambda load: load.peak)
        return Load(per_volt.peak * terminal_v, per_volt.rms * terminal_v, per_volt.cause)

    return {quantity: worst(quantity) for quantity in BaseQuantity}


def terminal_volts(excitation: Excitation, rig: Rig) -> float:
    """Peak at the generator's terminal at the largest setting of the plan [V]."""
    return 0.5 * excitation.amplitude_vpp * rig.generator.terminal_factor()


def plays_of(excitation: Excitation) -> tuple[list[Tone], list[Waveform], list[SampleSource]]:
    """All different tones, waveforms and sources of streams of a plan, at their loudest."""
    return _sorted(step.play for step in excitation.loudest_steps())


def _sorted(plays: Iterable[Play]) -> tuple[list[Tone], list[Waveform], list[SampleSource]]:
    """Split plays by kind."""
    tones: set[Tone] = set()
    waveforms: list[Waveform] = []
    sources: list[SampleSource] = []
    for play in plays:
        match play:
            case Tone():
                tones.add(play)
            case Waveform():
                waveforms.append(play)
            case Stream(source):
                sources.append(source)
    return sorted(tones, key=lambda tone: tone.frequency_hz), waveforms, sources


def _of_tones(transfer: Transfer, tones: list[Tone]) -> Load:
    levels = np.array([tone.level for tone in tones])
    peaks = levels * np.abs(transfer(np.array([tone.frequency_hz for tone in tones])))
    worst = int(np.argmax(peaks))
    peak = float(peaks[worst])
    return Load(peak, peak / np.sqrt(2), f"at {tones[worst].frequency_hz:g} Hz")


def of_waveform(transfer: Transfer, waveform: Waveform, number: int) -> Load:
    """Peak and rms per volt over one period of realisation ``number``."""
    lines = held_lines(waveform.values, HELD_SPANS)
    frequency_hz = np.arange(len(lines), dtype=np.float64) * np.float64(waveform.repetition_hz)
    answer = lines * transfer(frequency_hz)
    # Twice the points that the highest line needs, so that no peak hides between two of them.
    points = 4 * len(lines)
    one_sided = np.zeros(points // 2 + 1, dtype=np.complex128)
    one_sided[: len(lines)] = answer * (points / 2)
    one_sided[0] *= 2
    time_signal = np.fft.irfft(one_sided, points)
    peak, rms = float(np.max(np.abs(time_signal))), float(np.sqrt(np.mean(time_signal**2)))
    return Load(peak, rms, f"in realisation {number}")


def of_source(transfer: Transfer, source: SampleSource) -> Load:
    """Peak and rms per volt of streamed noise."""
    band_hz = np.linspace(source.band_start_hz, source.band_stop_hz, BAND_POINTS, dtype=np.float64)
    gain = float(np.sqrt(np.mean(np.abs(transfer(band_hz)) ** 2)))
    return Load(gain, gain / source.crest_factor, "streamed noise")


def needed_vpp(rig: Rig, acceleration: float, frequency_hz: float) -> float:
    """Give the setting, peak to peak [V], at which the base's acceleration has an amplitude [m/s2].

    The specimen is not in the model: where it pushes back, more or less is needed.

    Parameters
    ----------
    rig
        Its linear model is asked.
    acceleration
        Amplitude of the base [m/s2].
    frequency_hz
        Of the sine.

    """
    per_volt = abs(complex(RigModel(rig).transfer(BaseQuantity.ACCELERATION, frequency_hz)))
    return 2 * acceleration / (per_volt * rig.generator.terminal_factor())
