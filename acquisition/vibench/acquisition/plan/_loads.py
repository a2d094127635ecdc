"""Predict the peak loads of a plan on the rig, with the rig's model.

The prediction is exact while p stays inside the gap. Otherwise it gives the fundamental of a motion with p
limited to the gap. Impacts add to this fundamental (for how much they add, see
tests/acquisition/plan/test_specimen_loads.py). The real motion is monitored during the run.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..excitation.kinds import Excitation
from ..excitation.noise import held_lines
from ..excitation.steps import (
    CREST_FACTOR,
    GaussianBand,
    HeldAcceleration,
    Play,
    RelativeSetting,
    RmsSetting,
    Stream,
    Tone,
    Waveform,
)
from ..rig import BaseQuantity, ComplexArray, OnTable, Rig, RigModel

HELD_SPANS = 4
"""Number of spans, each of half the playback rate, for which the spectrum of a held waveform is computed.
Higher images are below 1/20 of the level of the band, and the table responds less to these images.
"""
PASSED_LEVELS = np.arange(1, 17) / 16
"""Fractions of a tone's level at which loads are computed. Ramps pass through these levels, and with stops a
lower level may cause a larger motion.
"""
BAND_POINTS = 2000
"""Number of frequencies at which the power of streamed noise is computed."""

Floats: TypeAlias = NDArray[np.float64]
Transfer: TypeAlias = Callable[[Floats], ComplexArray]
"""Function that returns the phasors of a quantity at given frequencies [Hz], for the largest setting."""


@dataclass(frozen=True)
class Load:
    """Largest peak and rms value of a quantity while a plan plays."""

    peak: float
    """Peak value of the quantity, in its SI unit."""
    rms: float
    """Largest rms value in any steady part of the plan, in the SI unit of the quantity."""
    cause: str
    """Part of the plan that causes the largest value: ``"at 150 Hz"``."""


Loads: TypeAlias = Mapping[BaseQuantity, Load]
"""Peak and rms load of every quantity of rig and specimen."""


def predicted_loads(excitation: Excitation, rig: Rig) -> Loads:
    """Return peak and rms of every quantity of rig and specimen in the steady state of ``excitation``.

    Sines are computed frequency by frequency, periodic waveforms as a sum of Fourier lines, including the
    images of the generator's hold. Streamed noise is Gaussian: its peak is the crest factor times the rms
    value. Ramps stay below the steady state because of their half-cosine shape.
    """
    terminal_v = 0.5 * excitation.amplitude_vpp * rig.generator.terminal_factor()
    model = RigModel(rig)
    # Every tone, waveform and stream source of the plan once, at its highest level.
    tones, waveforms, sources = _split_by_kind(step.play for step in excitation.loudest_steps())
    broad = [
        _BroadPlay(
            model,
            terminal_v,
            partial(_of_waveform, held_lines(each.values, HELD_SPANS), each.repetition_hz, number),
            np.arange(1.0, len(each.values) // 2) * float(each.repetition_hz),
        )
        for number, each in enumerate(waveforms)
    ]
    broad += [_BroadPlay(model, terminal_v, partial(_of_source, each), _band_hz(each)) for each in sources]

    def worst(quantity: BaseQuantity) -> Load:
        loads = [_of_tones(model, quantity, tones, terminal_v)] if tones else []
        return max([*loads, *(play.load(quantity) for play in broad)], key=lambda load: load.peak)

    return {quantity: worst(quantity) for quantity in BaseQuantity}


def _split_by_kind(plays: Iterable[Play]) -> tuple[list[Tone], list[Waveform], list[GaussianBand]]:
    tones: set[Tone] = set()
    waveforms: list[Waveform] = []
    sources: list[GaussianBand] = []
    for play in plays:
        match play:
            case Tone():
                tones.add(play)
            case Waveform():
                waveforms.append(play)
            case Stream(source):
                sources.append(source)
    return sorted(tones, key=lambda tone: tone.frequency_hz), waveforms, sources


def _of_tones(model: RigModel, quantity: BaseQuantity, tones: list[Tone], terminal_v: float) -> Load:
    hz = np.array([tone.frequency_hz for tone in tones])
    volts = terminal_v * np.array([tone.level for tone in tones])
    passed = [np.abs(model.under_sines(quantity, hz, level * volts)) for level in PASSED_LEVELS]
    peaks = np.max(passed, axis=0)
    worst = int(np.argmax(peaks))
    peak = float(peaks[worst])
    return Load(peak, peak / np.sqrt(2), f"at {tones[worst].frequency_hz:g} Hz")


class _BroadPlay:
    """Motion under a waveform or stream: free if p stays inside the gap, otherwise limited by the stops."""

    def __init__(
        self, model: RigModel, terminal_v: float, follow: Callable[[Transfer], Load], band_hz: Floats
    ) -> None:
        self._model = model
        self._terminal_v = terminal_v
        self._follow = follow
        self._band_hz = band_hz
        self._touches = self._load(model.transfer, BaseQuantity.P).peak > model.gap_m

    def load(self, quantity: BaseQuantity) -> Load:
        if not self._touches:
            return self._load(self._model.transfer, quantity)
        stuck = self._load(self._model.stuck_transfer, quantity)
        # Add the effect of a motion p with the amplitude of the gap, as an rms value over the band.
        lever = self._model.lever(quantity, self._band_hz)
        pushed = self._model.gap_m * float(np.sqrt(np.mean(np.abs(lever) ** 2)))
        return Load(stuck.peak + pushed, float(np.hypot(stuck.rms, pushed / np.sqrt(2))), stuck.cause)

    def _load(self, transfer: Callable[[BaseQuantity, Floats], ComplexArray], quantity: BaseQuantity) -> Load:
        return self._follow(lambda hz: self._terminal_v * transfer(quantity, hz))


def _band_hz(source: GaussianBand) -> Floats:
    return np.linspace(source.band_start_hz, source.band_stop_hz, BAND_POINTS, dtype=np.float64)


def _of_waveform(lines: ComplexArray, repetition_hz: float, number: int, transfer: Transfer) -> Load:
    frequency_hz = np.arange(len(lines), dtype=np.float64) * np.float64(repetition_hz)
    answer = lines * transfer(frequency_hz)
    # Take twice as many samples as the highest spectral line needs, to miss no peak between samples.
    points = 4 * len(lines)
    one_sided = np.zeros(points // 2 + 1, dtype=np.complex128)
    one_sided[: len(lines)] = answer * (points / 2)
    one_sided[0] *= 2
    time_signal = np.fft.irfft(one_sided, points)
    peak, rms = float(np.max(np.abs(time_signal))), float(np.linalg.norm(time_signal)) / points**0.5
    return Load(peak, rms, f"in realisation {number}")


def _of_source(source: GaussianBand, transfer: Transfer) -> Load:
    gain = float(np.sqrt(np.mean(np.abs(transfer(_band_hz(source))) ** 2)))
    return Load(gain, gain / CREST_FACTOR, "streamed noise")


def needed_vpp(
    rig: Rig, acceleration: float, frequency_hz: float, on_table: OnTable = OnTable.SPECIMEN
) -> float:
    """Return the setting at which the base reaches ``acceleration`` [m/s2], peak to peak [V].

    ``on_table`` describes what is mounted on the table in the rig's model. Feedback assumes a bare table,
    whose response is smooth, and corrects the difference.
    """
    terminal_v = float(RigModel(rig, on_table).volts_for(acceleration, frequency_hz)[0])
    return 2 * terminal_v / rig.generator.terminal_factor()


@dataclass(frozen=True, eq=False)
class BaseMotion:
    """Displacement amplitude of the base at each frequency [m]."""

    amplitude_m: NDArray[np.float64]
    basis: str
    """Basis of the predicted amplitude, as text: held level, linear model, or sine of equal rms value."""


def base_motion(excitation: Excitation, rig: Rig, frequency_hz: NDArray[np.float64]) -> BaseMotion:
    """Return the predicted base amplitude at each of ``frequency_hz``; exact if feedback holds the level.

    For other plans, the amplitude follows from the rig's model with specimen (noise: a sine of equal rms).
    """
    levels = [excitation.level_at(float(each)) for each in frequency_hz]
    model, terminal_v = RigModel(rig), 0.5 * excitation.amplitude_vpp * rig.generator.terminal_factor()
    amplitudes_m = []
    noise_m: float | None = None
    for level, at_hz in zip(levels, frequency_hz, strict=True):
        match level:
            case HeldAcceleration(acceleration):
                amplitudes_m.append(acceleration / (2 * np.pi * at_hz) ** 2)
            case RelativeSetting(share):
                stroke = model.under_sines(BaseQuantity.STROKE, at_hz, share * terminal_v)
                amplitudes_m.append(abs(complex(stroke)))
            case RmsSetting():
                if noise_m is None:
                    noise_m = np.sqrt(2) * predicted_loads(excitation, rig)[BaseQuantity.STROKE].rms
                amplitudes_m.append(noise_m)
    return BaseMotion(np.array(amplitudes_m, dtype=np.float64), levels[0].basis)
