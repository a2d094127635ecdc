"""Equalised noise at the base: the gain from drive to base at each spectral line sets the next drive."""

from dataclasses import dataclass
from math import log10, sqrt

import numpy as np

from ..errors import LimitExceeded
from ..excitation.noise import HeldNoise, density_at, shaped_period
from ..excitation.steps import Waveform
from ..instruments import Samples
from ..plan import Phase, RunState, ramp
from ..recording import NoiseNote
from ..rig import BaseQuantity, OnTable, RigModel
from .control_action import ControlAction, Controller
from .feedback_channels import LEAST_ANSWER
from .sine_loop import SineLoop

_NEWEST = 0.5
"""Weight of the newest gains in the average with earlier gains; single gains scatter due to impacts."""
_MOST_CHANGE = 4.0
"""Largest factor by which the squared gain of a spectral line may change from one realisation to the next."""


@dataclass(frozen=True)
class MeasuredDensities:
    """Power spectral densities of one realisation, per spectral line, averaged over ``resolution_hz``."""

    drive: Samples
    """Power spectral density of the drive voltage [V2/Hz]."""
    base: Samples
    """Power spectral density of the base acceleration [(m/s2)2/Hz]."""
    response: Samples
    """Power spectral density of m0's velocity [(m/s)2/Hz]."""
    kurtosis: float
    """Kurtosis of the base acceleration; 3 for Gaussian noise."""


class Equaliser:
    """Estimates of the squared gains from drive to base and from base to m0, at every spectral line."""

    def __init__(self, loop: SineLoop, plan: HeldNoise) -> None:
        self._plan = plan
        self._rate_hz = loop.channels.sample_rate_hz
        self._factor = loop.rig.generator.terminal_factor()
        self.frequency_hz = np.asarray(plan.lines * plan.repetition_hz, dtype=np.float64)
        self._to_velocity = np.abs(loop.channels.velocity_over_response(self.frequency_hz)) ** 2
        transfer = RigModel(loop.rig, OnTable.NOTHING).transfer(BaseQuantity.ACCELERATION, self.frequency_hz)
        self._modelled = np.abs(transfer) ** 2
        self._gain = self._modelled
        self._to_response: Samples | None = None

    @property
    def target(self) -> Samples:
        """Target density of the base: ``spectrum``, lowered where m0 would exceed its limit [(m/s2)2/Hz]."""
        if self._to_response is None or not self._plan.response_limits:
            return self._plan.density
        limit = density_at(self._plan.response_limits, self.frequency_hz)
        return np.minimum(self._plan.density, limit / np.maximum(self._to_response, 1e-300))

    def waveform(self, number: int, level_db: float) -> Waveform:
        """Return one period of the next drive, computed from the present gains.

        Raises LimitExceeded when the drive needs more than the plan's largest setting.
        """
        plan = self._plan
        density = self.target * 10 ** (level_db / 10) / self._gain
        peaks_v = np.sqrt(2 * density * plan.repetition_hz) / self._factor
        period = shaped_period(plan.lines, peaks_v, plan.points, plan.seed, number)
        needed_vpp = 2 * float(np.max(np.abs(period)))
        if needed_vpp > plan.amplitude_vpp:
            raise LimitExceeded(
                f"the spectrum needs {needed_vpp:.3g} Vpp at {level_db:g} dB, but the plan allows at most "
                f"amplitude_vpp = {plan.amplitude_vpp:g}. The run was ramped down, and its recording was "
                "kept; raise amplitude_vpp, or lower the spectrum where the base responds least"
            )
        return Waveform(2 * period / plan.amplitude_vpp, plan.repetition_hz)

    def update(self, drive: Samples, base: Samples, response: Samples) -> MeasuredDensities:
        """Update the gains from the signals of a realisation; return its power spectral densities.

        Raises LimitExceeded when the base moves far less than the model predicts.
        """
        densities = MeasuredDensities(
            self._density(drive),
            self._density(base),
            self._density(response) * self._to_velocity,
            _kurtosis(base),
        )
        self._require_answer(densities)
        newest = densities.base / np.maximum(densities.drive, 1e-300)
        mixed = _NEWEST * newest + (1 - _NEWEST) * self._gain
        self._gain = np.clip(mixed, self._gain / _MOST_CHANGE, self._gain * _MOST_CHANGE)
        ratio = densities.response / np.maximum(densities.base, 1e-300)
        known = self._to_response
        self._to_response = ratio if known is None else _NEWEST * ratio + (1 - _NEWEST) * known
        return densities

    def require_below_abort(self, densities: MeasuredDensities) -> None:
        """Raise LimitExceeded when the spectral density of base or m0 exceeds its abort limit at any line."""
        most = 10 ** (self._plan.abort_db / 10)
        lines = [("base", "(m/s2)2/Hz", densities.base, self._plan.density)]
        if self._plan.response_limits:
            limit = density_at(self._plan.response_limits, self.frequency_hz)
            lines.append(("velocity of m0", "(m/s)2/Hz", densities.response, limit))
        for what, unit, measured, line in lines:
            worst = int(np.argmax(measured / line))
            if measured[worst] > most * line[worst]:
                raise LimitExceeded(
                    f"the {what} reached {measured[worst]:.3g} {unit} at {self.frequency_hz[worst]:g} Hz, "
                    f"{10 * log10(measured[worst] / line[worst]):.1f} dB above {line[worst]:.3g}; abort_db = "
                    f"{self._plan.abort_db:g}. The run was ramped down, and its recording was kept; lower "
                    "the spectrum, or give more equalisations"
                )

    def off_db(self, densities: MeasuredDensities, level_db: float) -> Samples:
        """Return the ratio of measured base density to this realisation's target, per spectral line [dB]."""
        return np.asarray(10 * np.log10(np.maximum(densities.base, 1e-300) / self.target) - level_db)

    def _density(self, values: Samples) -> Samples:
        """Return the power spectral density per line, averaged over ``resolution_hz``, without leakage."""
        plan = self._plan
        count = round(self._rate_hz * plan.periods / plan.repetition_hz)
        spectrum = np.fft.rfft(values[:count])[plan.lines * plan.periods] * 2 / count
        width = max(1, round(plan.resolution_hz / plan.repetition_hz))
        return _average(np.abs(spectrum) ** 2 / 2 / plan.repetition_hz, width)

    def _require_answer(self, densities: MeasuredDensities) -> None:
        modelled = sqrt(float(np.sum(densities.drive * self._modelled)))
        measured = sqrt(float(np.sum(densities.base)))
        if measured < LEAST_ANSWER * modelled:
            raise LimitExceeded(
                f"the base acceleration was {measured / modelled:.1%} of the model's value; feedback needs "
                f"at least {LEAST_ANSWER:.0%}. The run was ramped down, and its recording was kept; check "
                "the accelerometer, its cable and the amplifier"
            )


def equalise_noise(loop: SineLoop, plan: HeldNoise) -> Controller[None]:
    """Equalise the noise while its level rises to the full spectrum; then record and go on equalising."""
    equaliser = Equaliser(loop, plan)
    yield from loop.listen_to_silence()
    segments = [step.segment for step in plan.steps()]
    for number in range(plan.stretches):
        kept = number - plan.equalisations
        level_db = min(0.0, plan.start_db * (1 - number / max(1, plan.equalisations - 1)))
        play = equaliser.waveform(number, level_db)
        yield ControlAction(ramp(RunState.RAMPING_UP, play, loop.measurement))
        if plan.settle_s > 0:
            yield ControlAction(Phase(RunState.SETTLING, play, plan.settle_s))
        state, segment = (RunState.SETTLING, None) if kept < 0 else (RunState.RECORDING, segments[kept])
        samples = yield ControlAction(Phase(state, play, plan.periods / plan.repetition_hz, segment))
        densities = equaliser.update(*loop.channels.rows(samples))
        off_db = equaliser.off_db(densities, level_db)
        yield ControlAction(None, (_note(plan, equaliser, densities, off_db, kept),))
        equaliser.require_below_abort(densities)
        yield ControlAction(ramp(RunState.RAMPING_DOWN, play, loop.measurement))


def _note(
    plan: HeldNoise, equaliser: Equaliser, densities: MeasuredDensities, off_db: Samples, kept: int
) -> NoiseNote:
    worst = int(np.argmax(np.abs(off_db)))
    return NoiseNote(
        realisation=max(kept, -1),
        base_rms=sqrt(float(np.sum(densities.base)) * plan.repetition_hz),
        asked_rms=sqrt(float(np.sum(equaliser.target)) * plan.repetition_hz),
        within=float(np.mean(np.abs(off_db) <= plan.tolerance_db)),
        worst_db=float(off_db[worst]),
        worst_hz=float(equaliser.frequency_hz[worst]),
        notched=float(np.mean(equaliser.target < 0.99 * plan.density)),
        kurtosis=densities.kurtosis,
    )


def _average(values: Samples, width: int) -> Samples:
    """Return the moving average over ``width`` values, or over fewer values near the ends."""
    sums = np.concatenate(([0.0], np.cumsum(values)))
    places = np.arange(values.size)
    first = np.maximum(places - width // 2, 0)
    last = np.minimum(first + width, values.size)
    return np.asarray((sums[last] - sums[first]) / (last - first))


def _kurtosis(values: Samples) -> float:
    centred = values - np.mean(values)
    return float(np.mean(centred**4) / max(float(np.mean(centred**2)) ** 2, 1e-300))
