"""Measured and simulated curves of one recording, computed for a comparison."""

import pickle
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from vibench.acquisition import open_recording
from vibench.sim import SpecimenTable

from ..comparison import Curve, CurveKind, CurveOrigin, predicted_curves, sorted_curve
from ..dynamics import RecordedLevel, recorded_level
from ..errors import NotEnoughData, UnusableData
from ..frequency_response.results import FrequencyResponseRequest
from ..kinds import ANALYSES, AnyResult, family_of
from ..overlay.overlay import AbstractOverlay, Simulation
from ..recordings.checks import Verdict
from ..recordings.facts import described_specimen, known_specimen
from ..sine.stepped_response import SteppedResponse
from ..sine.sweep import SweepResponse
from ..tables import Tabular
from .campaign_results import AnalysisFailure, result_of


@dataclass(frozen=True, eq=False)
class ComparedRecording(Tabular):
    """Curves and findings of a recording, small enough to be passed between processes."""

    path: Path
    name: str
    recording_id: str
    samples_id: str
    curves: tuple[Curve, ...]
    failures: tuple[str, ...]
    """One sentence for each simulation that failed."""
    warnings: tuple[str, ...]
    """Warnings from the checks of the recording."""
    kept: bytes
    """The whole result, pickled for reports; `stored_result` restores it."""


def compare_recording(
    path: Path, request: FrequencyResponseRequest, simulation: Simulation
) -> ComparedRecording:
    """Analyse a recording for a comparison, and return its curves.

    Raises AnalysisError or RecordingError when nothing in the recording can be analysed.

    Parameters
    ----------
    simulation
        Simulation to overlay, if any.
    """
    with open_recording(path) as recording:
        result, failures = result_of(recording, simulation, request)
    facts = result.analysis.facts
    if facts.mass != "m0":
        raise UnusableData(
            f"{path.name} is a point of a scan on {facts.mass}, but comparisons show m0; choose a recording "
            "of m0"
        )
    return ComparedRecording(
        path=path,
        name=facts.name,
        recording_id=facts.recording_id,
        samples_id=facts.samples_id,
        curves=tuple(sorted_curve(each) for each in _curves(result, facts.name)),
        failures=tuple(each.sentence for each in failures),
        warnings=tuple(each.text for each in result.analysis.checks if each.verdict is Verdict.WARNING),
        kept=pickle.dumps((result, failures)),
    )


def stored_result(compared: ComparedRecording) -> tuple[AnyResult, tuple[AnalysisFailure, ...]]:
    """Return the whole result and its failures; unpickling is safe, as the bytes never come from a file."""
    result, failures = pickle.loads(compared.kept)  # noqa: S301
    return result, failures


_NO_LEVEL = "{} does not contain levels for a range of frequencies; choose a stepped sine or a sweep"


def level_of_drive(compared: ComparedRecording) -> tuple[tuple[float, float], ...]:
    """Return pairs (frequency [Hz], base amplitude [m]) of a stepped sine or a sweep, sorted by frequency.

    Raises NotEnoughData when the recording is of another kind, or has a single frequency.
    """
    found = stored_result(compared)[0].analysis.response
    if isinstance(found, SweepResponse | SteppedResponse):
        with suppress(NotEnoughData):
            return recorded_level(found.frequency_hz, found.drive_amplitude_m)
    raise NotEnoughData(_NO_LEVEL.format(compared.path.name))


def recorded_response(path: Path, kinds: Collection[CurveKind] = (CurveKind.RESPONSE_I,)) -> RecordedLevel:
    """Return drive level and measured curves of a stepped sine or a sweep, to draw on a map or on branches.

    Raises NotEnoughData when the recording is of another kind, or has a single frequency; RecordingError when
    the file is not a recording.
    """
    with open_recording(path) as recording:  # raises errors before the long analysis
        is_at_one_frequency = "frequency_hz" in (recording.plan.get("excitation") or {})
        if is_at_one_frequency or family_of(recording.plan) in {"noise", "dwell"}:
            raise NotEnoughData(_NO_LEVEL.format(path.name))
        specimen = known_specimen(recording.bench)
    found = compare_recording(path, FrequencyResponseRequest(), Simulation.LEFT_OUT)
    measured = [
        each for each in found.curves if each.origin is CurveOrigin.MEASURED and each.response in kinds
    ]
    return RecordedLevel(path.stem, level_of_drive(found), measured, specimen)


def recorded_specimen(path: Path) -> SpecimenTable | None:
    """Return the specimen described in a recording; None if it describes none."""
    with open_recording(path) as recording:
        return described_specimen(recording.bench) if recording.bench.get("specimen") else None


def _of_draws(curve: Curve, overlay: AbstractOverlay[Any]) -> Curve:
    """Return the curve with the median and the scatter of all draws instead of the first draw."""
    note = f"{curve.note}; from the {overlay.run.driven.value}"
    found = overlay.quantity(curve.response.value)
    if found is None or overlay.run.draws == 1:
        return replace(curve, note=note)
    order = np.argsort(found.frequency_hz)
    at = np.searchsorted(found.frequency_hz[order], curve.frequency_hz)
    place = order[np.minimum(at, order.size - 1)]
    if not np.array_equal(found.frequency_hz[place], curve.frequency_hz):
        return replace(curve, note=note)
    return replace(
        curve,
        magnitude=found.median[place],
        relative_sd=found.relative_sd[place],
        note=f"median of {overlay.run.draws} draws from the {overlay.run.driven.value}",
    )


def _curves(result: AnyResult, name: str) -> Iterator[Curve]:
    curves = ANALYSES[result.kind].curves
    yield from curves(name, CurveOrigin.MEASURED, result.analysis.response)
    if result.overlay is None:
        return
    for each in curves(name, CurveOrigin.SIMULATED, result.overlay.response):
        yield _of_draws(each, result.overlay)
    if result.overlay.prediction.frequency_hz.size > 1:
        yield from predicted_curves(name, result.overlay.prediction)
