"""How far the specimen swings, and how fast its main mass moves, while a plan plays: an estimate beforehand.

Exact where p stays inside the gap. Where it does not, the fundamental of a motion whose p is held at the
gap (`vibench.sim.model`). Impacts add to it; tests/acquisition/plan/test_specimen_loads.py says how
much. What moves in fact is watched while it runs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from vibench.sim import BaseResponse, NoContact, Specimen, base_response

from ..excitation import Excitation, SampleSource, Tone, Waveform
from ..rig import BaseQuantity, ComplexArray, Rig, RigModel, specimen_of
from ._loads import BAND_POINTS, Load, of_source, of_waveform, plays_of, terminal_volts

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SpecimenLoads:
    """The largest motions of m0."""

    amplitude: Load
    """Displacement against the base [m]."""
    velocity: Load
    """Absolute, as a vibrometer sees it [m/s]."""


@dataclass(frozen=True)
class _Motion:
    """One quantity of m0 by its phasors: per unit of base displacement, and per unit of p."""

    free: Callable[[BaseResponse, Floats], ComplexArray]
    stuck: Callable[[BaseResponse, Floats], ComplexArray]
    lever: Callable[[BaseResponse, Floats], ComplexArray]


_AMPLITUDE = _Motion(
    free=lambda answer, _hz: answer.free_x - 1.0,
    stuck=lambda answer, _hz: answer.stuck_x - 1.0,
    lever=lambda answer, _hz: answer.lever,
)
_VELOCITY = _Motion(
    free=lambda answer, hz: 2j * np.pi * hz * answer.free_x,
    stuck=lambda answer, hz: 2j * np.pi * hz * answer.stuck_x,
    lever=lambda answer, hz: 2j * np.pi * hz * answer.lever,
)


def predicted_specimen_loads(excitation: Excitation, rig: Rig) -> SpecimenLoads:
    """Peak and rms of the specimen's motion while ``excitation`` plays, steady state."""
    answers = _Answers(specimen_of(rig))
    return SpecimenLoads(
        _worst(_AMPLITUDE, excitation, rig, answers), _worst(_VELOCITY, excitation, rig, answers)
    )


def _worst(motion: _Motion, excitation: Excitation, rig: Rig, answers: "_Answers") -> Load:
    swing = _Swing(motion, RigModel(rig), answers, terminal_volts(excitation, rig))
    tones, waveforms, sources = plays_of(excitation)
    loads = [swing.of_tones(tones)] if tones else []
    loads += [swing.of_waveform(each, number) for number, each in enumerate(waveforms)]
    loads += [swing.of_source(each) for each in sources]
    return max(loads, key=lambda load: load.peak)


class _Answers:
    """The specimen's answers; realisations have the same lines, so each is worked out once."""

    def __init__(self, specimen: Specimen) -> None:
        self.gap_m = inf if isinstance(specimen.contact, NoContact) else min(specimen.gaps_m)
        self._specimen = specimen
        self._known: dict[bytes, BaseResponse] = {}

    def at(self, hz: Floats) -> BaseResponse:
        key = hz.tobytes()
        if key not in self._known:
            self._known[key] = base_response(self._specimen, hz)
        return self._known[key]


class _Swing:
    """One quantity of m0 for every kind of play."""

    def __init__(self, motion: _Motion, model: RigModel, answers: _Answers, terminal_v: float) -> None:
        self._motion = motion
        self._model = model
        self._answer = answers.at
        self._gap_m = answers.gap_m
        self._terminal_v = terminal_v

    def of_tones(self, tones: list[Tone]) -> Load:
        hz = np.array([tone.frequency_hz for tone in tones])
        levels = np.array([tone.level for tone in tones])
        answer = self._answer(hz)
        base_m = levels * np.abs(self._base(hz))
        free = base_m * np.abs(self._motion.free(answer, hz))
        p_m = base_m * np.abs(answer.free_p)
        if self._gap_m < inf:
            held = base_m * np.abs(self._motion.stuck(answer, hz))
            held += self._gap_m * np.abs(self._motion.lever(answer, hz))
            free = np.where(p_m > self._gap_m, held, free)
        worst = int(np.argmax(free))
        peak = float(free[worst])
        return Load(peak, peak / np.sqrt(2), f"at {tones[worst].frequency_hz:g} Hz")

    def of_waveform(self, waveform: Waveform, number: int) -> Load:
        p = of_waveform(self._p, waveform, number)
        if p.peak <= self._gap_m:
            return of_waveform(self._free, waveform, number)
        lines = np.arange(1, len(waveform.values) // 2, dtype=np.float64)
        band_hz = lines * np.float64(waveform.repetition_hz)
        return self._with_stops(of_waveform(self._stuck, waveform, number), band_hz)

    def of_source(self, source: SampleSource) -> Load:
        p = of_source(self._p, source)
        if p.peak <= self._gap_m:
            return of_source(self._free, source)
        band_hz = np.linspace(source.band_start_hz, source.band_stop_hz, BAND_POINTS, dtype=np.float64)
        return self._with_stops(of_source(self._stuck, source), band_hz)

    def _with_stops(self, stuck: Load, band_hz: Floats) -> Load:
        """Add what a p at the gap does, wherever in the band it moves."""
        lever = self._motion.lever(self._answer(band_hz), band_hz)
        pushed = self._gap_m * float(np.sqrt(np.mean(np.abs(lever) ** 2)))
        return Load(stuck.peak + pushed, float(np.hypot(stuck.rms, pushed / np.sqrt(2))), stuck.cause)

    def _base(self, hz: Floats) -> ComplexArray:
        return self._terminal_v * self._model.transfer(BaseQuantity.STROKE, hz)

    def _p(self, hz: Floats) -> ComplexArray:
        return self._base(hz) * self._answer(hz).free_p

    def _free(self, hz: Floats) -> ComplexArray:
        return self._base(hz) * self._motion.free(self._answer(hz), hz)

    def _stuck(self, hz: Floats) -> ComplexArray:
        return self._base(hz) * self._motion.stuck(self._answer(hz), hz)
