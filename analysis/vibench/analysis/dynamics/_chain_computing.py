"""Compute runs of chains one by one."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition import open_recording
from vibench.sim import Harmonic, LinearSweep, Outcome, Sampled, TargetReport, count_text
from vibench.sim.chain import (
    BandGap,
    Chain,
    ChainTrajectory,
    band_frequencies_hz,
    band_gaps,
    bloch_factor,
    chain_lyapunov_exponent,
    chain_response,
    chain_response_to,
    chain_transmissibility,
    integrate_chain,
    mean_energies,
)

from ..errors import InvalidRequest
from ..frequency_response.transmissibility import transmissibility
from ..overlay.driven_rig import recorded_base_motion
from ..recordings.channels import BASE
from ..recordings.facts import plan_of, require_intact, require_measured_size, require_usable
from ..signals import PER_NEPER_DB, Reals
from ..tables import Tabular
from ._requests import ChainDrive, ChainRequest

WAVES = 61
"""Number of wave numbers from 0 to pi at which bands are computed."""
LINES = 800
"""Number of frequencies at which the transmissibility without contact is computed."""
MOST_SHOWN = 4
"""Maximum number of cells that are drawn if there is only one chain."""
ABOVE_BANDS = 1.15
"""Highest frequency of results without contact, relative to the upper edge of the highest band."""
REACHED = Outcome.REACHED_END.text


@dataclass(frozen=True, eq=False, kw_only=True)
class ChainRun(Tabular):
    """Results of one chain with one drive; arrays have one value per cell, starting at the base."""

    DOCUMENT: ClassVar = (
        "cells frequency_hz over_hz transmission transmission_error transmission_change target impacts "
        "observed_s energy_j energy_error_j outcome elapsed_s largest_p_m=largest_m "
        "lyapunov_per_s=exponent_per_s lyapunov_error_per_s=exponent_error_per_s"
    )

    cells: int
    frequency_hz: float
    """Frequency of a steady sine; NaN for other drives."""
    over_hz: Reals
    """Frequencies of the transmission, shape (m,); a single frequency under a steady sine."""
    transmission: Reals
    """Amplitude of m0's displacement x over the base amplitude at each frequency, shape (m, cells)."""
    transmission_error: Reals
    """Relative error of the transmission, shape (cells,); NaN if neither error nor time was requested."""
    transmission_change: Reals
    """Relative change of the transmission after the observation, shape (cells,); NaN except for sines."""
    target: TargetReport | None = None
    """Target values and reached values of error and computing time; None without targets."""
    largest_m: Reals
    """Largest |p| = |y - z| of every cell during the observation, shape (cells,)."""
    impacts: NDArray[np.int64]
    """Number of contacts of every cell during the observation, shape (cells,)."""
    observed_s: float
    energy_j: Reals
    """Mean energy of every cell with its link to the previous cell, shape (cells,)."""
    energy_error_j: Reals
    """Standard error of `energy_j`."""
    exponent_per_s: float = math.nan
    """Largest Lyapunov exponent; NaN if not requested."""
    exponent_error_per_s: float = math.nan
    time_s: Reals
    """Time axis of `motion_m`, shape (n,)."""
    motion_m: Reals
    """Displacement x of m0 in every cell, shape (n, cells), over the last periods of a steady sine. Under
    other drives, the RMS of x over equal parts of the run."""
    impact_time_s: Reals
    """Times of the contacts within the range of `time_s`, shape (contacts,)."""
    impact_cell: NDArray[np.int64]
    outcome: str
    elapsed_s: float = 0.0


@dataclass(frozen=True, eq=False)
class ChainAnswer(Tabular):
    """All results for one request of a chain."""

    OWN_UNITS: ClassVar = {"wave_numbers": "rad"}
    DOCUMENT: ClassVar = (
        "options=request gaps_hz wave_numbers_rad=wave_numbers bands_hz=bands_hz.T linear_hz "
        "attenuation_db_per_unit=attenuation_db linear_transmission=linear_transmissions runs elapsed_s"
    )

    request: ChainRequest
    runs: tuple[ChainRun, ...]
    elapsed_s: float

    @cached_property
    def gaps(self) -> tuple[BandGap, ...]:
        """Band gaps of the infinite chain without damping and without contact."""
        return band_gaps(self.request.unit)

    @property
    def gaps_hz(self) -> list[tuple[float, float]]:
        """Lower and upper end of each band gap."""
        return [(gap.lower_hz, gap.upper_hz) for gap in self.gaps]

    @cached_property
    def bands_hz(self) -> Reals:
        """Frequencies of undamped waves at `wave_numbers`, shape (WAVES, 3 x cells of the unit)."""
        return band_frequencies_hz(self.request.unit, self.wave_numbers)

    @property
    def wave_numbers(self) -> Reals:
        """Phase shift of a wave from one unit to the next [rad], shape (WAVES,)."""
        return np.linspace(0.0, np.pi, WAVES)

    @cached_property
    def linear_hz(self) -> Reals:
        """Evenly spaced frequencies for results without contact."""
        top = ABOVE_BANDS * float(self.bands_hz.max())
        return np.linspace(top / LINES, top, LINES)

    def linear_transmission(self, cells: int) -> Reals:
        """Return |displacement of m0 / U| without contact, at `linear_hz`, shape (LINES, cells)."""
        return np.asarray(np.abs(chain_transmissibility(self.request.chain(cells), self.linear_hz)[:, :, 0]))

    @property
    def linear_transmissions(self) -> dict[int, list[list[float]]]:
        """`linear_transmission` keyed by number of cells, with one list per cell."""
        return {cells: self.linear_transmission(cells).T.tolist() for cells in self.request.lengths}

    @cached_property
    def attenuation_db(self) -> Reals:
        """Attenuation per unit of the infinite damped chain, at `linear_hz` [dB]."""
        return np.asarray(-PER_NEPER_DB * np.log(np.abs(bloch_factor(self.request.unit, self.linear_hz))))

    @property
    def shown_cells(self) -> tuple[tuple[int, int, str], ...]:
        """Chain length, index and name of the cells to draw: each chain's last, or several of one chain."""
        lengths = self.request.lengths
        if len(lengths) > 1:
            return tuple((cells, cells - 1, f"{count_text(cells, 'cell')}: last") for cells in lengths)
        (cells,) = lengths
        places = np.unique(np.linspace(0, cells - 1, min(cells, MOST_SHOWN)).round().astype(int))
        return tuple((cells, int(place), f"cell {place + 1}") for place in places)

    @property
    def shown_run(self) -> ChainRun | None:
        """The last complete run, whose motion, energies and impacts are drawn."""
        return next((run for run in reversed(self.runs) if run.outcome == REACHED), None)

    def driven_transmission(self, cells: int, place: int) -> tuple[Reals, Reals]:
        """Return frequencies and transmissions of all runs of a chain at one cell, in order of the runs."""
        runs = [run for run in self.runs if run.cells == cells]
        if not runs:
            return np.zeros(0), np.zeros(0)
        over_hz = np.concatenate([run.over_hz for run in runs])
        return over_hz, np.concatenate([run.transmission[:, place] for run in runs])

    @property
    def cost_sentence(self) -> str:
        """Return a sentence on band gaps, runs and computing time."""
        gaps = ", ".join(
            f"{gap.lower_hz:.4g} Hz and above"
            if math.isinf(gap.upper_hz)
            else f"{gap.lower_hz:.4g} to {gap.upper_hz:.4g} Hz"
            for gap in self.gaps
        )
        text = f"Band gaps of the infinite chain: {gaps}."
        if not self.runs:
            return text
        impacts = sum(int(run.impacts.sum()) for run in self.runs)
        lost = sum(run.outcome != REACHED for run in self.runs)
        complaint = f"; {count_text(lost, 'run')} ended early" if lost else ""
        exactly = f"; error per contact {self.request.accuracy.promise:g}, in units of 100 µm and 0.1 m/s"
        if self.request.error is not None:
            met = sum(bool(np.all(run.transmission_error <= self.request.error)) for run in self.runs)
            exactly = f"; {met} runs reached an error of {100.0 * self.request.error:g} %"
        return (
            f"{text} {count_text(len(self.runs), 'run')} in {self.elapsed_s:.1f} s, {impacts} impacts "
            f"observed{exactly}{complaint}."
        )


SAMPLES_PER_PERIOD = 8
"""Number of samples per period of the highest relevant frequency, enough for mean energies."""
MOST_NUMBERS = 3e7
"""Maximum number of values stored for a run; they take 0.25 GB."""
SHOWN_PERIODS = 16
STRETCHES = 400
"""Maximum number of equal parts of a sweep or recording; the RMS of each part is shown."""
ENERGY_S, ENERGY_SHARE = 0.5, 0.25
"""Averaging time [s] of energies under a steady sine, after the responses were observed. If an error or a
time was requested, the averaging time is at most `ENERGY_SHARE` of the time simulated before averaging."""
SWEEP_PARTS = 120
"""Maximum number of parts of a swept transmission; a part has at least `FEWEST_PERIODS` drive periods."""
FEWEST_PERIODS = 12
SEGMENTS = 8
"""Number of segments averaged for the transmission with a recorded motion."""
X, VX = 0, 3
LEAST = 1e-9
"""Transmission below which changes are attributed to rounding errors."""


def chain_runs(request: ChainRequest) -> Iterator[ChainRun]:
    """Compute the runs of a chain request and yield them one by one.

    Raises InvalidRequest when the recording cannot be read, or a run is not possible.
    """
    for cells in request.lengths:
        chain = request.chain(cells)
        match request.drive:
            case ChainDrive.NONE:
                pass
            case ChainDrive.STEADY:
                for frequency_hz in request.frequencies_hz:
                    yield _time_run(_run_steady, chain, request, Harmonic(frequency_hz, request.amplitude_m))
            case ChainDrive.SWEPT:
                sweep = LinearSweep(
                    request.start_hz, request.stop_hz, request.duration_s, request.amplitude_m
                )
                yield _time_run(_run_sweep, chain, request, sweep)
            case ChainDrive.RECORDED:
                yield _time_run(_run_under_recording, chain, request, _base_of(request))


def chain_answer(request: ChainRequest) -> ChainAnswer:
    """Compute all runs of a chain request."""
    began = time.perf_counter()
    runs = tuple(chain_runs(request))
    return ChainAnswer(request, runs, time.perf_counter() - began)


Driven = TypeVar("Driven", Harmonic, LinearSweep, Sampled)


def _time_run(
    run: Callable[[Chain, ChainRequest, Driven], ChainRun], chain: Chain, request: ChainRequest, drive: Driven
) -> ChainRun:
    began = time.perf_counter()
    try:
        found = run(chain, request, drive)
    except ValueError as error:
        raise InvalidRequest(str(error)) from error
    return replace(found, elapsed_s=time.perf_counter() - began)


def _run_steady(chain: Chain, request: ChainRequest, drive: Harmonic) -> ChainRun:
    """Compute the responses in a run from rest, then energies and motion while the run continues."""
    whole_s, observed_s = request.settle_s + request.duration_s, request.duration_s
    relative_error, target = np.full(chain.size, math.nan), None
    if request.has_target:
        found, relative_error, whole_s, target = chain_response_to(
            chain, drive, request.error, request.time_s
        )
        observed_s = found.window_s
    else:
        found = chain_response(chain, drive, request.accuracy, whole_s, observed_s)
    if found.outcome is not Outcome.REACHED_END:
        return _bare_run(chain, found.outcome, found.impacts, whole_s, drive.frequency_hz)
    after_s = min(observed_s, ENERGY_S, ENERGY_SHARE * whole_s if request.has_target else math.inf)
    after_s = max(1.0, math.floor(after_s * drive.frequency_hz)) / drive.frequency_hz
    run = integrate_chain(
        chain, drive, after_s, found.accuracy, found.final_state,
        _rate_hz(chain, drive.frequency_hz, after_s), start_time_s=whole_s,
    )  # fmt: skip
    if run.outcome is not Outcome.REACHED_END:
        return _bare_run(chain, run.outcome, found.impacts, whole_s, drive.frequency_hz)
    exponent = error = math.nan
    if request.exponent_s > 0.0:
        growth = chain_lyapunov_exponent(
            chain, drive, duration_s=request.exponent_s, settle_s=whole_s - observed_s
        )
        exponent, error = growth.exponent_per_s, growth.standard_error_per_s
    turns = drive.frequency_hz * run.time_s + drive.phase_rad / (2.0 * np.pi)
    base = drive.amplitude_m * np.sin(2.0 * np.pi * turns)
    after = _component(run.states[:, :, X], turns) / drive.amplitude_m
    shown = run.time_s >= run.end_time_s - SHOWN_PERIODS / drive.frequency_hz
    energy, energy_error = mean_energies(chain, run.states, base)
    struck = run.impacts.times_s >= run.time_s[shown][0] if shown.any() else np.zeros(0, np.bool_)
    return replace(
        _bare_run(chain, run.outcome, found.impacts, observed_s, drive.frequency_hz),
        transmission=found.response_ii[None, :, X],
        transmission_error=relative_error,
        transmission_change=np.abs(after / np.maximum(found.response_ii[:, X], LEAST) - 1.0),
        target=target,
        largest_m=found.largest_m[:, -1],
        energy_j=energy,
        energy_error_j=energy_error,
        exponent_per_s=exponent,
        exponent_error_per_s=error,
        time_s=run.time_s[shown],
        motion_m=run.states[shown, :, X],
        impact_time_s=run.impacts.times_s[struck],
        impact_cell=run.impacts.cells[struck],
    )


def _run_sweep(chain: Chain, request: ChainRequest, drive: LinearSweep) -> ChainRun:
    run = integrate_chain(
        chain, drive, drive.duration_s, request.accuracy,
        sample_rate_hz=_rate_hz(chain, drive.highest_hz, drive.duration_s),
    )  # fmt: skip
    if run.outcome is not Outcome.REACHED_END:
        return _bare_run(chain, run.outcome, run.impacts.per_cell, run.end_time_s)
    base = drive.amplitude_m * np.sin(2.0 * np.pi * drive.turns(run.time_s))
    over_hz, ratio = _component_over_time(run, drive)
    return _whole_run(chain, run, base, over_hz, ratio)


def _run_under_recording(chain: Chain, request: ChainRequest, drive: Sampled) -> ChainRun:
    rate, duration_s = drive.sample_rate_hz, min(drive.duration_s, request.duration_s)
    # The estimator needs response and base at the same times.
    run = integrate_chain(
        chain, drive, duration_s, request.accuracy, sample_rate_hz=_require_rate(rate, chain, duration_s)
    )
    if run.outcome is not Outcome.REACHED_END:
        return _bare_run(chain, run.outcome, run.impacts.per_cell, run.end_time_s)
    base = drive.displacement_m[: len(run.time_s)]
    segment = max(16, len(run.time_s) // SEGMENTS)
    found = [
        transmissibility(base, run.states[:, cell, X], rate, segment_samples=segment)
        for cell in range(chain.size)
    ]
    is_shown = found[0].frequency_hz <= 2.0 * chain.natural_frequencies_hz[-1]
    known = [np.where(each.is_significant, np.abs(each.value), np.nan) for each in found]
    ratio = np.stack(known, axis=-1)
    return _whole_run(chain, run, base, found[0].frequency_hz[is_shown], ratio[is_shown])


def _bare_run(
    chain: Chain,
    outcome: Outcome,
    impacts: NDArray[np.int64],
    observed_s: float,
    frequency_hz: float = math.nan,
) -> ChainRun:
    """Return a result with only outcome and impacts, as for a run that stopped early."""
    unknown, nothing = np.full(chain.size, math.nan), np.zeros(0)
    return ChainRun(
        cells=chain.size,
        frequency_hz=frequency_hz,
        over_hz=np.array([frequency_hz]),
        transmission=unknown[None, :],
        transmission_error=unknown,
        transmission_change=unknown,
        largest_m=unknown,
        impacts=impacts,
        observed_s=observed_s,
        energy_j=unknown,
        energy_error_j=unknown,
        time_s=nothing,
        motion_m=np.zeros((0, chain.size)),
        impact_time_s=nothing,
        impact_cell=np.zeros(0, np.int64),
        outcome=outcome.text,
    )


def _whole_run(chain: Chain, run: ChainTrajectory, base: Reals, over_hz: Reals, ratio: Reals) -> ChainRun:
    """Build the result of a run, including the motion over the whole run."""
    energy, error = mean_energies(chain, run.states, base)
    stretches = np.array_split(np.arange(len(run.time_s)), min(STRETCHES, max(1, len(run.time_s))))
    sizes = [np.sqrt(np.mean(run.states[each, :, X] ** 2, axis=0)) for each in stretches]
    p = run.states[..., 1] - run.states[..., 2]
    return replace(
        _bare_run(chain, run.outcome, run.impacts.per_cell, run.end_time_s),
        over_hz=over_hz,
        transmission=ratio,
        largest_m=np.max(np.abs(p), axis=0),
        energy_j=energy,
        energy_error_j=error,
        time_s=np.array([run.time_s[each].mean() for each in stretches]),
        motion_m=np.array(sizes),
        impact_time_s=run.impacts.times_s,
        impact_cell=run.impacts.cells,
    )


def _component_over_time(run: ChainTrajectory, drive: LinearSweep) -> tuple[Reals, Reals]:
    """Return drive frequencies and the relative amplitude at each, from Hann-weighted parts of the sweep."""
    lowest_hz = min(drive.start_hz, drive.stop_hz)
    parts = int(min(SWEEP_PARTS, max(1.0, drive.duration_s * lowest_hz / FEWEST_PERIODS)))
    pieces = np.array_split(np.arange(len(run.time_s)), parts)
    over_hz = np.array([drive.frequency_hz(run.time_s[each]).mean() for each in pieces])
    turns = drive.turns(run.time_s)
    lines = np.array([_component(run.states[each, :, X], turns[each]) for each in pieces])
    order = np.argsort(over_hz)
    return over_hz[order], lines[order] / drive.amplitude_m


def _component(motion_m: Reals, turns: Reals) -> Reals:
    """Return each column's Hann-weighted amplitude at the drive frequency; ``turns`` is the phase per row."""
    taper = np.hanning(len(turns) + 2)[1:-1]
    return np.asarray(2.0 * np.abs((taper * np.exp(-2j * np.pi * turns)) @ motion_m) / taper.sum())


def _base_of(request: ChainRequest) -> Sampled:
    """Read the base motion of a recording."""
    path = Path(request.recording)
    with open_recording(path) as recording:
        require_measured_size(recording)
        require_intact(recording)
        require_usable(recording, BASE)
        return Sampled(recorded_base_motion(recording, plan_of(recording)), recording.sample_rate_hz)


def _rate_hz(chain: Chain, highest_hz: float, duration_s: float) -> float:
    """Choose a sample rate that resolves the fastest motion and fits into memory."""
    highest_hz = max(highest_hz, float(chain.natural_frequencies_hz[-1]))
    return _require_rate(SAMPLES_PER_PERIOD * highest_hz, chain, duration_s)


def _require_rate(rate_hz: float, chain: Chain, duration_s: float) -> float:
    wanted = rate_hz * duration_s * chain.size * 2.0 * VX
    if wanted > MOST_NUMBERS:
        raise ValueError(
            f"{chain.size} cells for {duration_s:g} s need {wanted:.2g} numbers, more than the "
            f"{MOST_NUMBERS:.0g} that fit into memory; choose fewer cells or a shorter run"
        )
    return rate_hz
