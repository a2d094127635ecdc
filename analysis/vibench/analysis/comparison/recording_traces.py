"""The curves of one recording, and of what the model says of it, as a comparison shows them."""

import pickle
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vibench.acquisition import open_recording

from ..arrays import Reals
from ..campaign_results import (
    DwellResult,
    Failure,
    NoiseResult,
    Result,
    Simulation,
    SteppedSineResult,
    SweepResult,
    result_of,
)
from ..dwell import DwellResponse
from ..noise_request import NoiseRequest
from ..prediction import Prediction
from ..results import Transmission
from ..stepped_response import SteppedResponse
from ..sweep import SweepResponse
from .trace import Origin, Response, Trace, sorted_trace

SAME_HZ = 0.01
"""Frequencies that lie within this are one [Hz]."""


@dataclass(frozen=True, eq=False)
class ComparedRecording:
    """What a comparison keeps of a recording; small, so that it crosses from the process that made it."""

    path: Path
    name: str
    traces: tuple[Trace, ...]
    failures: tuple[str, ...]
    """Sentences on what could not be analysed or simulated."""
    warnings: tuple[str, ...]
    """What the checks of the recording found."""
    kept: bytes
    """The whole result, for reports: only they open it, with `kept_result`."""


def compared_recording(path: Path, request: NoiseRequest, simulation: Simulation) -> ComparedRecording:
    """Analyse a recording for a comparison.

    Raises
    ------
    AnalysisError, RecordingError
        When nothing in it is usable, in one sentence.

    """
    with open_recording(path) as recording:
        result, failures = result_of(recording, simulation, request)
    name = result.analysis.facts.name
    return ComparedRecording(
        path=path,
        name=name,
        traces=tuple(sorted_trace(each) for each in _traces(result, name)),
        failures=tuple(each.sentence for each in failures),
        warnings=tuple(each.text for each in result.analysis.checks if each.verdict.value == "warning"),
        kept=pickle.dumps((result, failures)),
    )


def kept_result(compared: ComparedRecording) -> tuple[Result, tuple[Failure, ...]]:
    """Open the whole result again; the bytes were made by this program a moment ago, never by a file."""
    result, failures = pickle.loads(compared.kept)  # noqa: S301
    return result, failures


def _traces(result: Result, name: str) -> Iterator[Trace]:
    match result:
        case NoiseResult(analysis=noise, laid=laid):
            yield transmission_trace(name, Origin.MEASURED, noise.response.transmission)
            if laid is not None:
                yield transmission_trace(name, Origin.SIMULATED, laid.response.transmission)
        case SweepResult(analysis=sweep, laid=laid):
            yield from sweep_traces(name, Origin.MEASURED, sweep.response)
            if laid is not None:
                yield from sweep_traces(name, Origin.SIMULATED, laid.response)
        case DwellResult(analysis=dwell, laid=laid):
            yield from dwell_traces(name, Origin.MEASURED, dwell.response)
            if laid is not None:
                yield from dwell_traces(name, Origin.SIMULATED, laid.response)
        case SteppedSineResult(analysis=stepped, laid=laid):
            yield from stepped_traces(name, Origin.MEASURED, stepped.response)
            if laid is not None:
                yield from stepped_traces(name, Origin.SIMULATED, laid.response)
    if result.laid is not None and result.laid.prediction.frequency_hz.size > 1:
        yield from predicted_traces(name, result.laid.prediction)


def predicted_traces(name: str, found: Prediction) -> Iterator[Trace]:
    """Give Responses I and II under sines."""
    low, high = 1e6 * float(found.amplitude_m.min()), 1e6 * float(found.amplitude_m.max())
    level = f"{low:.3g} µm" if low == high else f"{low:.3g} to {high:.3g} µm"
    note = f"sines of A0 = {level}, {found.accuracy.value}"
    unknown = np.full(found.frequency_hz.shape, np.nan)
    yield Trace(
        name, Origin.PREDICTED, Response.RESPONSE_I, found.frequency_hz, found.response_i, unknown, note
    )
    yield Trace(
        name, Origin.PREDICTED, Response.RESPONSE_II, found.frequency_hz, found.response_ii, unknown, note
    )


def transmission_trace(name: str, origin: Origin, found: Transmission) -> Trace:
    """Make a curve of an estimated transmission, with its bounds."""
    how = found.settings
    note = f"{how.estimator.value}, {found.n_eff:.3g} averages, lines {found.resolution_hz:.3g} Hz wide"
    return Trace(
        name,
        origin,
        Response.TRANSMISSION,
        found.frequency_hz,
        found.magnitude,
        found.relative_sd_magnitude,
        note,
    )


def sweep_traces(name: str, origin: Origin, found: SweepResponse) -> Iterator[Trace]:
    """Make a curve of each response that a sweep measured."""
    note = f"{found.sweep_rate_hz_per_s:+.3g} Hz/s"
    yield from _responses(
        name, origin, found.frequency_hz, (found.response_i, found.response_ii, found.sd_response_ii), note
    )


def stepped_traces(name: str, origin: Origin, found: SteppedResponse) -> Iterator[Trace]:
    """Make a curve of each response that a stepped sine measured."""
    """Give steps up and steps down as curves of their own: between jumps they differ."""
    if found.frequency_hz.size > 1 and np.ptp(found.frequency_hz) < SAME_HZ:
        return  # levels at one frequency are no curve over it
    directions = np.array(found.direction)
    for direction in dict.fromkeys(found.direction):
        at = directions == direction
        values = (found.response_i[at], found.response_ii[at], found.sd_response_ii[at])
        yield from _responses(
            f"{name} {direction}", origin, found.frequency_hz[at], values, f"steps {direction}"
        )


def dwell_traces(name: str, origin: Origin, found: DwellResponse) -> Iterator[Trace]:
    """Make a point of each response that a dwell measured."""
    values = (
        np.array([found.response_i]),
        np.array([found.response_ii]),
        np.array([found.sd_response_ii]),
    )
    note = f"window of {found.window_s:.3g} s, A0 = {1e6 * found.drive.amplitude_m:.3g} µm"
    yield from _responses(name, origin, np.array([found.drive.frequency_hz]), values, note)


def _responses(
    name: str, origin: Origin, frequency_hz: Reals, values: tuple[Reals, Reals, Reals], note: str
) -> Iterator[Trace]:
    first, second, sd_second = values
    unknown = np.full(frequency_hz.shape, np.nan)
    yield Trace(name, origin, Response.RESPONSE_I, frequency_hz, first, unknown, note)
    yield Trace(name, origin, Response.RESPONSE_II, frequency_hz, second, sd_second / second, note)
