"""Parameters of a specimen from statistics of its chaotic motion, for motions that cannot be tracked."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.signal
from numpy.lib.stride_tricks import sliding_window_view

from vibench.acquisition.recording import Recording
from vibench.sim import Hertz, HuntCrossley, LinearGap, Specimen

from ..errors import InvalidRequest, NotEnoughData, UnusableData
from ..hidden_motion import FoundParameter, Hidden, tracked_specimen, value_of, with_values
from ..overlay.draws import StretchDraws, stretch_draws
from ..overlay.driven_rig import FittedShaker
from ..signals import Flags, Integers, Reals
from .specimen_fit import SpecimenFit

# Approximate Bayesian computation with regression: parameters of a model from statistics of its runs.
# Parameters are drawn at random from a box (the ranges of all parameters); each draw is simulated in one run.
# Each parameter is regressed on the statistics of the runs (Beaumont, Zhang and Balding 2002; Fearnhead and
# Prangle 2012). The posterior is the prediction for the observed statistics plus leave-one-out errors. Its
# intervals have the stated coverage for parameters in the box, even for a poor regression (conformal
# prediction; Vovk, Gammerman and Shafer 2005). Then the box is narrowed and sampled again (Deistler,
# Goncalves and Macke 2022).

ROUNDS = (120, 120, 240)
"""Number of simulated runs in each box (range of parameters), from the widest to the narrowest box."""
_MARGIN = 1.25
"""Ratio of the half width of the next box to the largest error of the regression."""
_RIDGES = np.geomspace(1e-4, 1e4, 25)
_COMPONENTS = 15
"""Number of principal components of the statistics along which the observed statistics are checked."""
_FAR = 1.05
"""Largest distance of the observed statistics at which the model fits, relative to the furthest run's.

A correct model exceeds the furthest of n runs in at most one of n + 1 cases. The margin allows for small
differences between rig and recording.
"""

_CONFIDENCE = 0.95
_BOUNDS = (0.5 - 0.5 * _CONFIDENCE, 0.5 + 0.5 * _CONFIDENCE)

Runs = Callable[[Reals], Reals]
"""Map parameters, shape (draws, parameters), to the statistics of the runs, shape (draws, statistics)."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """Posterior of parameters for observed statistics."""

    draws: Reals
    """Random parameters from the posterior, shape (draws, parameters)."""
    distance: float
    """Distance of the observed statistics relative to the furthest run; infinite if any is out of range."""

    @property
    def fits(self) -> bool:
        """Whether the observed statistics are compatible with the runs."""
        return self.distance <= _FAR


def posterior(
    runs: Runs, observed: Reals, box: Reals, seed: int, rounds: Sequence[int] = ROUNDS
) -> Posterior:
    """Return the posterior: in each round, draw parameters, simulate, regress, and narrow the box.

    Parameters
    ----------
    runs
        Function that simulates runs for given parameters and returns their statistics.
    observed
        Observed statistics, shape (statistics,).
    box
        Range of each parameter with a uniform prior, shape (parameters, 2).
    seed
        Seed of the draws.
    rounds
        Number of runs in each box.
    """
    rng = np.random.default_rng(seed)
    parameters, statistics = np.empty((0, len(box))), np.empty((0, observed.size))
    for wanted in rounds:
        inside = np.all((parameters >= box[:, 0]) & (parameters <= box[:, 1]), axis=1)
        parameters, statistics = parameters[inside], statistics[inside]
        new = rng.uniform(box[:, 0], box[:, 1], (wanted - len(parameters), len(box)))
        # If the box did not change, all earlier runs lie in it, and no new runs are needed.
        if len(new):
            parameters = np.concatenate([parameters, new])
            statistics = np.concatenate([statistics, runs(new)])
        middle, errors = _regression(statistics, parameters, observed)
        reach = _MARGIN * np.abs(errors).max(axis=0)
        narrower = np.clip(np.stack([middle - reach, middle + reach], axis=1), box[:, :1], box[:, 1:])
        low, high = np.quantile(middle + errors, _BOUNDS, axis=0)
        is_inside = np.all((high > box[:, 0]) & (low < box[:, 1]))
        found = np.clip(middle + errors, box[:, 0], box[:, 1])
        guessed = np.vstack([parameters - errors, middle])
        box = narrower
    return Posterior(found, _distance(guessed, statistics, observed) if is_inside else np.inf)


def _regression(statistics: Reals, parameters: Reals, observed: Reals) -> tuple[Reals, Reals]:
    """Return the parameters (n,) for the observed statistics, and leave-one-out errors (draws, n)."""
    middle, scale = statistics.mean(axis=0), statistics.std(axis=0) + 1e-12
    u, sizes, vt = np.linalg.svd((statistics - middle) / scale, full_matrices=False)
    new = vt @ ((observed - middle) / scale)
    mean = parameters.mean(axis=0)
    found, errors = np.empty(parameters.shape[1]), np.empty(parameters.shape)
    for n, target in enumerate((parameters - mean).T):
        tried = [_leave_one_out_errors(u, sizes, target, ridge) for ridge in _RIDGES]
        best = int(np.argmin([np.sum(each**2) for each in tried]))
        errors[:, n] = tried[best]
        weight = sizes / (sizes**2 + _RIDGES[best])
        found[n] = mean[n] + (weight * (u.T @ target)) @ new
    return found, errors


def _leave_one_out_errors(u: Reals, sizes: Reals, target: Reals, ridge: float) -> Reals:
    """Return the leave-one-out errors of a ridge regression in closed form."""
    shrunk = sizes**2 / (sizes**2 + ridge)
    fitted = (u * shrunk) @ (u.T @ target)
    leverage = np.sum(u**2 * shrunk, axis=1) + 1 / len(target)
    return np.asarray((target - fitted) / (1 - leverage))


def _distance(parameters: Reals, statistics: Reals, observed: Reals) -> float:
    """Return the distance of the observed statistics from the model, relative to the furthest run.

    The effect of the fitted parameters is removed. The remainder is measured along the largest components and
    outside of these components. Each run is compared only with the other runs; including the run itself would
    shorten its distance.

    Parameters
    ----------
    parameters
        Fitted parameters; the last row belongs to the observation, shape (draws + 1, parameters).
    statistics
        Statistics of runs, shape (draws, statistics).
    observed
        Shape (statistics,).
    """
    size = (parameters - parameters[:-1].mean(axis=0)) / (parameters[:-1].std(axis=0) + 1e-12)
    terms = np.column_stack([np.ones(len(size)), size, size**2])
    values = np.vstack([statistics, observed]) / (statistics.std(axis=0) + 1e-12)
    seen = _distances(terms[:-1], values[:-1], terms[-1], values[-1])
    furthest = np.zeros(2)
    for number in range(len(statistics)):
        others = np.arange(len(statistics)) != number
        own = _distances(terms[:-1][others], values[:-1][others], terms[number], values[number])
        furthest = np.maximum(furthest, own)
    return float(np.sqrt(np.max(seen / furthest)))


def _distances(terms: Reals, values: Reals, own_terms: Reals, own_values: Reals) -> Reals:
    """Return a run's squared distances from other runs: along their components, and outside of these.

    ``own_terms`` and ``own_values`` belong to this run, with shapes (terms,) and (statistics,).
    """
    known, *_ = np.linalg.lstsq(terms, values, rcond=None)
    _, spread, axes = np.linalg.svd(values - terms @ known, full_matrices=False)
    rest = own_values - own_terms @ known
    along = axes[:_COMPONENTS] @ rest
    beyond = rest - along @ axes[:_COMPONENTS]
    return np.array([np.sum((along / spread[:_COMPONENTS]) ** 2), np.sum(beyond**2)])


_SEGMENT_S = 0.1
_LOWEST_HZ, _HIGHEST_HZ = 40.0, 12_000.0
_HIGHEST_PART = 0.4
"""Highest evaluated frequency as a fraction of the sample rate, inside the converter's pass band."""
_BANDS = 18
_ABOVE_NOISE = 4.0
_COHERENT_HZ = 1_000.0
_DRIFT_HZ = 10.0
_HARMONICS = 5
_SHARES = (0.5, 0.9, 0.99, 0.999)


def chaos_statistics(motion: Reals, rate_hz: float, drive_hz: float | None) -> Reals:
    """Return statistics of a stretch of irregular motion, shape (statistics,).

    Statistics are the logarithmic band powers of base acceleration and m0's velocity, and their coherence per
    band. Further statistics are spread, skewness and tails of m0's velocity and displacement, and, for a sine
    drive, harmonics. Even harmonics distinguish the two stops.

    Parameters
    ----------
    motion
        Base acceleration [m/s2] and m0's velocity [m/s], shape (2, samples).
    rate_hz
        Sample rate [Hz].
    drive_hz
        Frequency of a sine drive; None for other drives.
    """
    velocity = motion[1]
    parts = (*_in_bands(motion, rate_hz), _spread(velocity), _spread(_displacement(velocity, rate_hz)))
    lines = () if drive_hz is None else (_harmonics(motion, rate_hz, drive_hz),)
    return np.concatenate([*parts, *lines])


def above_sensor_noise(statistics: Reals, noise_rms: Reals, rate_hz: float) -> Flags:
    """Return flags of the statistics that are above the noise of the channels.

    Parameters
    ----------
    statistics
        Statistics of a recording.
    noise_rms
        White noise of base acceleration and m0's velocity per sample, shape (2,).
    rate_hz
        Sample rate [Hz].
    """
    length, first = _bands(rate_hz)
    floor = 2 * np.log(noise_rms) + np.log(np.sum(np.hanning(length) ** 2) * _ABOVE_NOISE)
    limits = (floor[:, None] + np.log(np.diff(first))).ravel()
    found = np.ones(statistics.size, dtype=np.bool_)
    found[: limits.size] = statistics[: limits.size] > limits
    return found


def _bands(rate_hz: float) -> tuple[int, Integers]:
    """Return the segment length [samples], and the band edges as line numbers of a segment's spectrum."""
    length = round(_SEGMENT_S * rate_hz)
    edges = np.geomspace(_LOWEST_HZ, min(_HIGHEST_HZ, _HIGHEST_PART * rate_hz), _BANDS + 1)
    return length, np.asarray(np.ceil(edges * length / rate_hz), dtype=np.int64)


def _in_bands(motion: Reals, rate_hz: float) -> tuple[Reals, ...]:
    length, first = _bands(rate_hz)
    pieces = sliding_window_view(motion, length, axis=1)[:, :: length // 2]
    lines = np.fft.rfft(pieces * np.hanning(length))
    power = np.mean(np.abs(lines) ** 2, axis=1)
    cross = np.abs(np.mean(lines[0] * lines[1].conj(), axis=0))
    bands = np.add.reduceat(power[:, : first[-1]], first[:-1], axis=1)
    slow = first[1:] < _COHERENT_HZ * _SEGMENT_S
    together = np.add.reduceat(cross[: first[-1]], first[:-1])[slow]
    return np.log(bands[0]), np.log(bands[1]), together / np.sqrt(bands[0, slow] * bands[1, slow])


def _displacement(velocity: Reals, rate_hz: float) -> Reals:
    """Return displacement times the sample rate, high-passed below all drive frequencies."""
    b, a = scipy.signal.butter(2, _DRIFT_HZ, "highpass", fs=rate_hz)
    return np.asarray(scipy.signal.lfilter(b, a, np.cumsum(velocity - velocity.mean())))


def _spread(values: Reals) -> Reals:
    centred = values - values.mean()
    squared = centred * centred
    rms = float(np.sqrt(squared.mean()))
    tails = np.quantile(np.abs(centred), _SHARES) / rms
    skewness, kurtosis = np.vdot(squared, centred) / rms**3, np.vdot(squared, squared) / rms**4
    return np.array([np.log(rms), skewness / values.size, kurtosis / values.size, *np.log(tails)])


def _harmonics(motion: Reals, rate_hz: float, drive_hz: float) -> Reals:
    """Return harmonics of velocity / rms velocity, with phases relative to the base's fundamental."""
    turn = np.exp(-2j * np.pi * drive_hz / rate_hz * np.arange(motion.shape[1]))
    tapered = motion * np.hanning(motion.shape[1])
    base = np.vdot(turn.conj(), tapered[0]) / motion.shape[1]
    back, phase = turn, base / abs(base)
    found = np.empty(_HARMONICS, dtype=np.complex128)
    for k in range(_HARMONICS):
        found[k] = np.vdot(back.conj(), tapered[1]) / motion.shape[1] / phase ** (k + 1)
        back = back * turn
    found /= motion[1].std()
    return np.array([np.log(abs(base)), np.log(abs(found[0])), *found.real, *found.imag])


_AROUND = {Hidden.MEAN_GAP: 2.0, "apart": 1.5, Hidden.M1: 1.05, Hidden.C1: 2.0, Hidden.FORCE: 3.0}
"""Factor of each parameter's search range; gaps: geometric mean, and sqrt(upper / lower) ("apart")."""
_WIDEST = 0.5
"""Largest width of bounds relative to the search range; wider bounds leave a parameter undetermined."""
_LIKELY = 2.0
"""Largest allowed ratio between the rms base accelerations of the recording and of the first run."""
_LEAST_S, _LEAST_RATE_HZ = 0.5, 5_000.0
_SEED = 29


def statistical_numbers(
    recording: Recording,
    specimen: Specimen,
    stretch_s: tuple[float, float],
    drive_hz: float | None,
    fitted: FittedShaker | None = None,
    linear: SpecimenFit | None = None,
    rounds: Sequence[int] = ROUNDS,
) -> tuple[tuple[FoundParameter, ...], float]:
    """Return gaps, m1, c1 and contact force with 95 % bounds, or the reason why each is undetermined.

    Rig and specimens are simulated from the recorded voltage and compared with the recording by statistics.
    The second result is the distance of the statistics relative to the furthest run. Raises AnalysisError
    when rig, contact law or samples are unsuitable, or no specimen has these statistics.

    Parameters
    ----------
    recording
        A recording with collisions.
    specimen
        Starting point of the search, with fitted linear parameters.
    stretch_s
        Start and end of the stretch.
    drive_hz
        Drive frequency of a sine; None for sweeps and noise.
    fitted
        Fitted shaker, if the bench describes none.
    linear
        Fit of the linear parameters; each run draws random values within their uncertainty.
    rounds
        Number of runs in each box; boxes become narrower.
    """
    rate_hz = recording.sample_rate_hz
    start, stop = (round(each * rate_hz) for each in stretch_s)
    if not np.isfinite(specimen.gaps_m).all():
        raise InvalidRequest("the specimen has a stop on one side only; a fit to statistics needs two stops")
    draws = stretch_draws(recording, specimen, start, stop, fitted)
    measured = draws.recorded_motion
    if measured.shape[1] < _LEAST_S * rate_hz or rate_hz < _LEAST_RATE_HZ:
        raise NotEnoughData(
            f"{measured.shape[1] / rate_hz:.3g} s of this motion at {rate_hz:g} samples/s are too short for "
            f"statistics; record at least {_LEAST_S:g} s at {_LEAST_RATE_HZ:g} samples/s or more"
        )
    if np.isnan(measured).any():
        raise UnusableData("samples were lost, so statistics cannot be compared with a simulation")
    observed = chaos_statistics(measured, rate_hz, drive_hz)
    made = _Runs(draws, specimen, linear, drive_hz, above_sensor_noise(observed, draws.noise_rms, rate_hz))
    seen, drawn = (float(np.std(each[0])) for each in (measured, draws.draw(specimen, made.rng)))
    if not 1 / _LIKELY < seen / drawn < _LIKELY:
        raise UnusableData(
            f"the recorded voltage should give {drawn:.3g} m/s2 rms on the described rig, but {seen:.3g} "
            "m/s2 were recorded, so no simulation is possible; correct the described amplifier and shaker"
        )
    reach = np.log(list(_AROUND.values()))
    found = posterior(made, observed[made.heard], np.stack([-reach, reach], axis=1), _SEED, rounds)
    if not found.fits:
        raise UnusableData(
            f"no simulated specimen has similar statistics (distance {found.distance:.2g} times the scatter "
            "of repeated simulations): some other value in the description of rig or specimen is wrong"
        )
    return tuple(_determined_parameters(found, specimen)), found.distance


@dataclass(frozen=True, eq=False)
class _Runs:
    """Simulated runs with given parameters and random initial states."""

    draws: StretchDraws
    specimen: Specimen
    linear: SpecimenFit | None
    drive_hz: float | None
    heard: Flags
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(_SEED))

    def __call__(self, parameters: Reals) -> Reals:
        """Return the statistics of one run for each row of ``parameters``."""
        seeds = self.rng.spawn(len(parameters))
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return np.array(list(pool.map(self._one, parameters, seeds)))

    def _one(self, logarithms: Reals, rng: np.random.Generator) -> Reals:
        specimen = self.specimen if self.linear is None else self.linear.random_specimen(rng)
        motion = self.draws.draw(_specimen_of(specimen, logarithms), rng)
        return chaos_statistics(motion, self.draws.recording.sample_rate_hz, self.drive_hz)[self.heard]


def _relative(logarithms: Reals) -> dict[Hidden, Reals]:
    """Return parameters by name, as logarithms relative to the description; shape (5,) or (5, draws)."""
    mean, apart, m1, c1, force = logarithms
    return {
        Hidden.LOWER_GAP: mean - apart,
        Hidden.UPPER_GAP: mean + apart,
        Hidden.M1: m1,
        Hidden.C1: c1,
        Hidden.FORCE: force,
    }


def _specimen_of(specimen: Specimen, logarithms: Reals) -> Specimen:
    tracked = tracked_specimen(specimen)
    other = with_values(
        tracked,
        {what: value_of(tracked, what) * float(np.exp(part)) for what, part in _relative(logarithms).items()},
    )
    if not isinstance(specimen.contact, Hertz | LinearGap | HuntCrossley):
        raise InvalidRequest("the specimen is described without stops")
    return replace(other.specimen, contact=replace(specimen.contact, stiffness=other.steepness))


def _determined_parameters(found: Posterior, specimen: Specimen) -> Iterator[FoundParameter]:
    described = tracked_specimen(specimen)
    parts = _relative(found.draws.T)
    lower, upper = specimen.gaps_m
    sides = lower * np.exp(parts[Hidden.LOWER_GAP]) + upper * np.exp(parts[Hidden.UPPER_GAP])
    parts = {Hidden.MEAN_GAP: np.log(sides / (lower + upper)), **parts}
    for what, each in parts.items():
        low, high = np.quantile(each, _BOUNDS)
        flat = high - low > _WIDEST * _CONFIDENCE * 2 * np.log(_AROUND.get(what, _AROUND[Hidden.MEAN_GAP]))
        value = value_of(described, what)
        low, high = (value * float(np.exp(each)) for each in (low, high))
        why = "statistics of the motion give no narrower bounds than the description" if flat else ""
        # Results are written as a value with a half width, so the value is the centre of the bounds.
        yield FoundParameter(what, 0.5 * (low + high), low, high, value, why)
    nan, why = float("nan"), "not varied: all simulations have the exponent and loss of the description"
    for untold in (Hidden.EXPONENT, Hidden.LOSS):
        yield FoundParameter(untold, nan, nan, nan, value_of(described, untold), why)
