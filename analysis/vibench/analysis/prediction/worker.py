"""Simulations for the window; they send results in pieces and can be cancelled."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from vibench.acquisition import AcquisitionError
from vibench.sim import Harmonic, Outcome, integrate
from vibench.sim.background import Cancelled
from vibench.sim.study import (
    MESSAGE,
    MemoryStore,
    PointAnswer,
    PointState,
    Start,
    Study,
    ThreadExecutor,
    prediction_at,
    run_study,
)

from ..dynamics import BranchRequest, ChainRequest, SpectrumRequest, branch_lines, chain_runs, spectrum_points
from ..tables import columns
from .progress import (
    MapRequest,
    MotionRequest,
    PartialResult,
    SimulatedPoint,
    SimulatedSignal,
    SimulationRequest,
    Trouble,
    WatchedStore,
    map_pictures,
    settled_motion,
)

Tell = Callable[[tuple[PartialResult, ...]], None]
SIGNAL_PERIODS = 12
SAMPLES_PER_PERIOD = 400


def _pieces(store: MemoryStore, study: Study, answers: Sequence[PointAnswer]) -> Iterator[PartialResult]:
    """Yield the results of a study's points as pieces for the window."""
    for answer in answers:
        place = study.grid.place(answer.number)
        model, frequency_hz = study.models[place[0]], study.frequencies_hz[place[-1]]
        if answer.state is PointState.FAILED:
            message = bytes(store.arrays[MESSAGE][answer.number]).decode()
            yield Trouble(f"{model} at {frequency_hz:g} Hz: {message}")
            continue
        amplitude_m = study.amplitudes_m[place[-3]]
        found = prediction_at(
            store.arrays, answer.number, frequency_hz, amplitude_m, study.accuracy, Start.REST.value
        )
        keys = "frequency_hz response_i response_ii impacts lyapunov_per_s memory ensemble"
        yield SimulatedPoint(model, **columns(found, keys))


def simulate(
    request: SimulationRequest, tell: Tell, cancelled: Cancelled, workers: int | None = None
) -> None:
    """Compute a request, the time signals first; return early when cancelled.

    ``cancelled`` is called several times a second; points in progress (less than 1 s each) are finished.
    """
    for model in request.models if request.signal_hz is not None else ():
        if cancelled():
            return
        tell((simulated_signal(request, model, request.signal_hz or 0.0),))
    study = request.study
    store = WatchedStore(study, lambda answers: tell(tuple(_pieces(store, study, answers))))
    executor = ThreadExecutor(workers)
    try:
        run_study(study, executor, store, cancelled=cancelled)
    finally:
        executor.close()


def simulated_signal(
    request: SimulationRequest, model: str, frequency_hz: float
) -> SimulatedSignal | Trouble:
    """Simulate the specimen from rest, and return the last drive periods."""
    specimen = request.specimen_under(model)
    drive = Harmonic(frequency_hz, request.amplitude_m)
    shown_s = min(SIGNAL_PERIODS / frequency_hz, 0.5 * request.duration_s)
    lead_s = request.duration_s - shown_s
    lead = integrate(specimen, drive, lead_s, request.accuracy)
    if lead.outcome is not Outcome.REACHED_END:
        return Trouble(f"{model} at {frequency_hz:g} Hz: {lead.outcome.text}")
    end = integrate(
        specimen,
        drive,
        shown_s,
        request.accuracy,
        lead.final_state,
        SAMPLES_PER_PERIOD * frequency_hz,
        start_time_s=lead_s,
    )
    states = np.asarray(end.states)
    return SimulatedSignal(
        model=model,
        frequency_hz=frequency_hz,
        time_s=np.asarray(end.time_s),
        displacement_m=states[:, 0],
        relative_m=states[:, 1] - states[:, 2],
        gaps_m=specimen.gaps_m,
    )


Asked = SimulationRequest | BranchRequest | SpectrumRequest | ChainRequest | MapRequest | MotionRequest
"""Requests that the process can compute."""


def answer(request: Asked, tell: Tell, cancelled: Cancelled) -> None:
    """Compute a request and send the result in pieces; return early when cancelled."""
    try:
        match request:
            case SimulationRequest():
                simulate(request, tell, cancelled)
            case BranchRequest():
                _send_each(branch_lines(request), tell, cancelled)
            case SpectrumRequest():
                _send_each(spectrum_points(request), tell, cancelled)
            case ChainRequest():
                _send_each(chain_runs(request), tell, cancelled)
            case MapRequest():
                map_pictures(request, lambda picture: tell((picture,)), cancelled)
            case MotionRequest():
                tell((settled_motion(request),))
    except (ValueError, AcquisitionError) as error:
        tell((Trouble(str(error)),))


def _send_each(parts: Iterable[PartialResult], tell: Tell, cancelled: Cancelled) -> None:
    for part in parts:
        if cancelled():
            return
        tell((part,))
