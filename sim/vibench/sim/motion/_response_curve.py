"""Responses over frequency at one amplitude: the prediction that is laid over a measurement. SI units."""

import os
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..kernels import Floats
from ..model import Accuracy, AccuracyWord, Harmonic, Specimen, chosen
from ._response import Response, steady_response

Quantity = Literal["response_i", "response_ii", "relative_i", "relative_ii"]
Progress = Callable[[int, int], None]
"""Told (points done, points in all), in the calling thread."""
Cancelled = Callable[[], bool]
"""Asked after every point, in the calling thread."""


@dataclass(frozen=True, eq=False)
class ResponseCurve:
    """Responses at ascending or descending frequencies, as asked; shorter when it was cancelled."""

    specimen: Specimen
    points: tuple[Response, ...]
    asked: int
    """How many frequencies were asked for."""

    @property
    def is_complete(self) -> bool:
        """Whether every frequency was answered."""
        return len(self.points) == self.asked

    @property
    def frequency_hz(self) -> Floats:
        """Shape (points,)."""
        return np.array([point.drive.frequency_hz for point in self.points])

    def values(self, quantity: Quantity) -> Floats:
        """One quantity of every point, over the drive amplitude, shape (points,)."""
        return np.array([getattr(point, quantity) for point in self.points])


def response_curve(
    specimen: Specimen,
    amplitude_m: float,
    frequencies_hz: ArrayLike,
    accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
    workers: int | None = None,
    duration_s: float = 30.0,
    window_s: float = 5.0,
    progress: Progress | None = None,
    cancelled: Cancelled | None = None,
) -> ResponseCurve:
    """Compute a response curve, every point from rest, on several threads.

    Parameters
    ----------
    specimen, amplitude_m, frequencies_hz
        What is driven, by how much [m], and at which frequencies, shape (n,) [Hz].
    accuracy, duration_s, window_s
        As in `steady_response`.
    workers
        Threads; the kernels run without the interpreter lock. All cores when None.
    progress, cancelled
        Called between points; when ``cancelled`` says yes, the points that are done are returned.

    Raises
    ------
    ValueError
        When an argument is not allowed; before any point is computed.

    """
    accuracy = chosen(Accuracy, accuracy)
    frequencies = np.atleast_1d(np.asarray(frequencies_hz, dtype=np.float64))
    if frequencies.ndim != 1 or len(frequencies) == 0:
        msg = f"Frequencies of shape {frequencies.shape} are not allowed: give one row of one or more."
        raise ValueError(msg)
    drives = [Harmonic(float(frequency), amplitude_m) for frequency in frequencies]
    threads = (os.cpu_count() or 1) if workers is None else workers
    if threads < 1:
        msg = f"{threads} workers are not allowed: give one or more."
        raise ValueError(msg)
    done: dict[int, Response] = {}
    with ThreadPoolExecutor(threads) as pool:
        pending: dict[Future[Response], int] = {
            pool.submit(steady_response, specimen, drive, accuracy, duration_s, window_s): index
            for index, drive in enumerate(drives)
        }
        try:
            while pending:
                for future in wait(pending, return_when=FIRST_COMPLETED).done:
                    done[pending.pop(future)] = future.result()
                    _tell(progress, len(done), len(drives))
                if cancelled is not None and cancelled():
                    break
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
    return ResponseCurve(specimen, tuple(done[index] for index in sorted(done)), len(drives))


def _tell(progress: Progress | None, done: int, asked: int) -> None:
    if progress is not None:
        progress(done, asked)
