"""What a plan will do to the rig, before anything moves: peaks through the rig's linear model."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..excitation.kinds import Excitation
from ..excitation.multisine import held_lines
from ..excitation.steps import Play, SampleSource, Stream, Tone, Waveform
from ..rig.configuration import Rig
from ..rig.model import Quantity, RigModel

HELD_SPANS = 4
"""A held waveform is followed to twice its playback rate: the images above are below 1/20 of the band
and the table answers them ever less."""
BAND_POINTS = 2000
"""Frequencies over which the mean square of streamed noise is summed."""


@dataclass(frozen=True)
class Load:
    """The largest a quantity becomes while a plan plays."""

    peak: float
    """SI unit of the quantity."""
    rms: float
    """Over the worst steady stretch; SI unit of the quantity."""
    cause: str
    """What in the plan does it: ``"at 150 Hz"``."""


def predicted_loads(excitation: Excitation, rig: Rig) -> dict[Quantity, Load]:
    """Peak and rms of every quantity of the rig while ``excitation`` plays, steady state.

    Exact for the linear model: by frequency for sines, by Fourier lines summed in time for periodic
    waveforms (the images of the generator's hold included). Streamed noise is Gaussian: its peak is
    taken as its own crest factor times the rms value. Ramps stay below by their half-cosine shape.
    """
    terminal_v = 0.5 * excitation.amplitude_vpp * rig.generator.terminal_factor()
    model = RigModel(rig)
    tones, waveforms, sources = _sorted(step.play for step in excitation.loudest_steps())

    def worst(quantity: Quantity) -> Load:
        loads = [_of_tones(model, quantity, tones)] if tones else []
        loads += [_of_waveform(model, quantity, each, number) for number, each in enumerate(waveforms)]
        loads += [_of_source(model, quantity, each) for each in sources]
        per_volt = max(loads, key=lambda load: load.peak)
        return Load(per_volt.peak * terminal_v, per_volt.rms * terminal_v, per_volt.cause)

    return {quantity: worst(quantity) for quantity in Quantity}


def _sorted(plays: Iterable[Play]) -> tuple[list[Tone], list[Waveform], list[SampleSource]]:
    """Split plays by kind: all different tones, waveforms, sources of streams."""
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


def _of_tones(model: RigModel, quantity: Quantity, tones: list[Tone]) -> Load:
    levels = np.array([tone.level for tone in tones])
    peaks = levels * np.abs(model.transfer(quantity, np.array([tone.frequency_hz for tone in tones])))
    worst = int(np.argmax(peaks))
    peak = float(peaks[worst])
    return Load(peak, peak / np.sqrt(2), f"at {tones[worst].frequency_hz:g} Hz")


def _of_waveform(model: RigModel, quantity: Quantity, waveform: Waveform, number: int) -> Load:
    lines = held_lines(waveform.values, HELD_SPANS)
    frequency_hz = np.arange(len(lines)) * waveform.repetition_hz
    answer = lines * model.transfer(quantity, frequency_hz)
    # Twice the points that the highest line needs, so that no peak hides between two of them.
    points = 4 * len(lines)
    one_sided = np.zeros(points // 2 + 1, dtype=np.complex128)
    one_sided[: len(lines)] = answer * (points / 2)
    one_sided[0] *= 2
    time_signal = np.fft.irfft(one_sided, points)
    peak, rms = float(np.max(np.abs(time_signal))), float(np.sqrt(np.mean(time_signal**2)))
    return Load(peak, rms, f"in realisation {number}")


def _of_source(model: RigModel, quantity: Quantity, source: SampleSource) -> Load:
    band_hz = np.linspace(source.band_start_hz, source.band_stop_hz, BAND_POINTS)
    gain = float(np.sqrt(np.mean(np.abs(model.transfer(quantity, band_hz)) ** 2)))
    return Load(gain, gain / source.crest_factor, "streamed noise")
