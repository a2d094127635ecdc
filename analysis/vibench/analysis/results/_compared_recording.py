"""The curves of one recording, and of what the model says of it, as a comparison shows them."""

import pickle
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from vibench.acquisition import open_recording

from ..comparison import (
    Curve,
    CurveOrigin,
    dwell_traces,
    predicted_curves,
    sorted_curve,
    stepped_traces,
    sweep_traces,
    transmission_trace,
)
from ..frequency_response import FrequencyResponseRequest
from ..model import Simulation
from ._campaign_results import (
    AnalysisFailure,
    DwellResult,
    NoiseResult,
    Result,
    SteppedSineResult,
    SweepResult,
    result_of,
)


@dataclass(frozen=True, eq=False)
class ComparedRecording:
    """What a comparison keeps of a recording; small, so that it crosses from the process that made it."""

    path: Path
    name: str
    curves: tuple[Curve, ...]
    failures: tuple[str, ...]
    """Sentences on what could not be analysed or simulated."""
    warnings: tuple[str, ...]
    """What the checks of the recording found."""
    kept: bytes
    """The whole result, for reports: only they open it, with `kept_result`."""


def compare_recording(
    path: Path, request: FrequencyResponseRequest, simulation: Simulation
) -> ComparedRecording:
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
        curves=tuple(sorted_curve(each) for each in _curves(result, name)),
        failures=tuple(each.sentence for each in failures),
        warnings=tuple(each.text for each in result.analysis.checks if each.verdict.value == "warning"),
        kept=pickle.dumps((result, failures)),
    )


def kept_result(compared: ComparedRecording) -> tuple[Result, tuple[AnalysisFailure, ...]]:
    """Open the whole result again; the bytes were made by this program a moment ago, never by a file."""
    result, failures = pickle.loads(compared.kept)  # noqa: S301
    return result, failures


def _curves(result: Result, name: str) -> Iterator[Curve]:
    match result:
        case NoiseResult(analysis=noise, laid=laid):
            yield transmission_trace(name, CurveOrigin.MEASURED, noise.response.frequency_response)
            if laid is not None:
                yield transmission_trace(name, CurveOrigin.SIMULATED, laid.response.frequency_response)
        case SweepResult(analysis=sweep, laid=laid):
            yield from sweep_traces(name, CurveOrigin.MEASURED, sweep.response)
            if laid is not None:
                yield from sweep_traces(name, CurveOrigin.SIMULATED, laid.response)
        case DwellResult(analysis=dwell, laid=laid):
            yield from dwell_traces(name, CurveOrigin.MEASURED, dwell.response)
            if laid is not None:
                yield from dwell_traces(name, CurveOrigin.SIMULATED, laid.response)
        case SteppedSineResult(analysis=stepped, laid=laid):
            yield from stepped_traces(name, CurveOrigin.MEASURED, stepped.response)
            if laid is not None:
                yield from stepped_traces(name, CurveOrigin.SIMULATED, laid.response)
    if result.laid is not None and result.laid.prediction.frequency_hz.size > 1:
        yield from predicted_curves(name, result.laid.prediction)
