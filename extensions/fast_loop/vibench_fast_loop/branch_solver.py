"""Equations of a branch: the unknowns are drive settings, the residuals are deviations of the base."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Coefficients = NDArray[np.complex128]

_LEARNT = 1e-4
"""Smallest change of the unknowns from which the derivative is updated."""
_DOUBTED = 0.05
"""Assumed standard error of the derivative, which sets the derivative's weight against measurement noise."""
_REFERENCE_STEP = 0.15
"""Relative change of the first coefficient that counts as one step along the branch."""
_RATIO_STEP = 1.0
"""Change of the ratio m0 / base that counts as one step along the branch."""
_RATIO = 2
"""Number of rows for the ratio m0 / base (real and imaginary part), after the rows of the residual."""
_NEW = 0.3
"""Fraction of a step by which a point must advance to count as a new point."""
_CHORD, _CHORD_ERRORS = 0.1, 20.0
"""Smallest distance between two points that define a direction: in steps (points move by less than this
within the tolerance), and in standard errors."""


@dataclass(frozen=True, eq=False)
class LoopSetting:
    """Controller setting, including the unknowns of the equations."""

    frequency_hz: float
    reference_v: Coefficients
    """Coefficients of the harmonics [V], shape (harmonics,). The first coefficient is real, which fixes the
    phase."""


@dataclass(frozen=True, eq=False)
class MeasuredPoint:
    """Unknowns of the equations at one setting, with residual and ratio of the measured response."""

    unknowns: Vector
    residual: Vector
    """Deviation of the base from the required sine, relative to the level."""
    ratio: complex
    """Complex ratio of the fundamentals of m0 and base."""
    noise: Vector
    """Standard errors of the residual, and of the real and the imaginary part of `ratio`."""

    @property
    def place(self) -> Vector:
        """Coordinates for the arc length [steps]: frequency, and real and imaginary part of the ratio."""
        return np.array([self.unknowns[0], self.ratio.real / _RATIO_STEP, self.ratio.imag / _RATIO_STEP])


@dataclass(frozen=True, eq=False)
class PredictedPoint:
    """Prediction of the next point on the branch."""

    unknowns: Vector
    place: Vector
    along: Vector
    length: float


class BranchSolver:
    """Newton's method with a derivative that is updated by measurements (Broyden, Math. Comp. 19 (1965) 577).

    The equations require the given amplitude of the base's fundamental, and zero amplitude of each harmonic.
    The unknowns (frequency and coefficients) outnumber the equations by one. The arc length uses frequency
    and ratio m0 / base: at a fold with low damping, the coefficients hardly change while the phase of m0
    turns by 180 degrees.

    Parameters
    ----------
    start
        First setting of the branch.
    gains
        Base displacement per volt at each harmonic, from the model [m/V], shape (harmonics,).
    bend
        Relative change of the magnitude of the first gain with frequency, from the model [1/Hz].
    level_m
        Amplitude of the base displacement at the start [m].
    step_hz
        Length of one step in frequency [Hz].
    """

    def __init__(
        self, start: LoopSetting, gains: Coefficients, bend: float, level_m: float, step_hz: float
    ) -> None:
        self._step_hz = step_hz
        self._volts = level_m / np.abs(gains)
        size = 2 * len(gains) - 1
        self._slope = np.zeros((size + _RATIO, size + 1))
        self._slope[0, :2] = bend * step_hz, _REFERENCE_STEP
        for k in range(1, len(gains)):
            turn = gains[k] / abs(gains[k])
            rows, columns = slice(2 * k - 1, 2 * k + 1), slice(2 * k, 2 * k + 2)
            self._slope[rows, columns] = [[turn.real, -turn.imag], [turn.imag, turn.real]]
        self._last: MeasuredPoint | None = None
        rest = start.reference_v[1:] / self._volts[1:]
        parts = np.column_stack([rest.real, rest.imag]).ravel()
        first = np.log(start.reference_v[0].real / self._volts[0]) / _REFERENCE_STEP
        self._begin = np.concatenate([[start.frequency_hz / self._step_hz, first], parts])

    def first(self) -> PredictedPoint:
        """Return the first prediction, at the fixed frequency of the branch's start."""
        along = np.array([1.0, 0.0, 0.0])
        return PredictedPoint(self._begin, along * self._begin[0], along, 0.0)

    def predict(self, points: Sequence[MeasuredPoint], length: float, way: float) -> PredictedPoint:
        """Return a prediction at distance ``length``; ``way`` (1 or -1) is the direction at the start."""
        here = points[-1]
        if len(points) == 1:
            along = np.array([way, 0.0, 0.0])
            level = -self._slope[0, 0] / self._slope[0, 1]
            moved = np.concatenate([[way, way * level], np.zeros(len(here.unknowns) - 2)])
        else:
            behind = _reference(points)
            chord = here.place - behind.place
            along = chord / np.linalg.norm(chord)
            moved = (here.unknowns - behind.unknowns) / np.linalg.norm(chord)
        return PredictedPoint(here.unknowns + length * moved, here.place + length * along, along, length)

    def setting(self, unknowns: Vector) -> LoopSetting:
        """Return the controller setting that corresponds to these unknowns."""
        volts = np.exp(_REFERENCE_STEP * unknowns[1]) * self._volts[0]
        rest = (unknowns[2::2] + 1j * unknowns[3::2]) * self._volts[1:]
        return LoopSetting(
            float(unknowns[0]) * self._step_hz, np.concatenate([[volts], rest]).astype(np.complex128)
        )

    def learn(self, point: MeasuredPoint) -> None:
        """Update the derivative from the difference between the last measurement and this measurement."""
        if self._last is not None:
            moved = point.unknowns - self._last.unknowns
            changed = _outputs(point) - _outputs(self._last)
            length = float(moved @ moved)
            if length > _LEARNT**2:
                divisor = length + (np.hypot(point.noise, self._last.noise) / _DOUBTED) ** 2
                self._slope += np.outer((changed - self._slope @ moved) / divisor, moved)
        self._last = point

    def probe(self, column: int, here: MeasuredPoint, beside: MeasuredPoint) -> None:
        """Update the derivative with respect to one unknown, from two measurements."""
        moved = beside.unknowns[column] - here.unknowns[column]
        found = (_outputs(beside) - _outputs(here)) / moved
        noise = np.hypot(beside.noise, here.noise) / moved
        believed = self._slope[:, column]
        doubt = np.maximum(np.abs(found - believed), _DOUBTED)
        self._slope[:, column] += (found - believed) * doubt**2 / (doubt**2 + noise**2)
        self._last = beside

    def correct(self, point: MeasuredPoint, predicted: PredictedPoint) -> Vector:
        """Return the next iterate, in the plane that contains the prediction, perpendicular to the arc."""
        along = predicted.along
        row = along[1:] @ self._slope[-_RATIO:]
        row[0] += along[0]
        table = np.vstack([self._slope[:-_RATIO], row])
        wanted = -np.append(point.residual, along @ (point.place - predicted.place))
        step = np.linalg.lstsq(table, wanted, rcond=1e-3)[0]
        length = float(np.hypot(*step[:2]))
        return np.asarray(point.unknowns + step * min(1.0, 1.0 / max(length, 1e-12)))


def is_new(point: MeasuredPoint, predicted: PredictedPoint) -> bool:
    """Return whether a point is far enough from the last point, in the forward direction."""
    short = float(predicted.along @ (predicted.place - point.place))
    return predicted.length == 0.0 or short <= (1 - _NEW) * predicted.length


def residual_of(base_m: Coefficients, level_m: float) -> Vector:
    """Return the residual relative to the level: amplitude of the fundamental, then each harmonic.

    ``base_m`` starts with the first harmonic, with phases relative to the first coefficient [m].
    """
    rest = base_m[1:] / level_m
    return np.concatenate([[abs(base_m[0]) / level_m - 1.0], np.column_stack([rest.real, rest.imag]).ravel()])


def noise_of(base_u: Vector, ratio_u: float) -> Vector:
    """Return the standard errors of residual and ratio; ``base_u`` is relative to the level."""
    return np.concatenate([base_u[:1], np.repeat(base_u[1:], 2), [ratio_u, ratio_u]])


def _reference(points: Sequence[MeasuredPoint]) -> MeasuredPoint:
    """Return the newest point far enough from the last one to define a direction; else the first point."""
    here = points[-1]
    for there in reversed(points[1:-1]):
        error = float(np.linalg.norm([here.noise[-_RATIO:], there.noise[-_RATIO:]]))
        if np.linalg.norm(here.place - there.place) >= max(_CHORD, _CHORD_ERRORS * error):
            return there
    return points[0]


def _outputs(point: MeasuredPoint) -> Vector:
    return np.append(point.residual, point.place[1:])
