"""Hidden motion during a measurement, by the filter that is also used to analyse recordings.

Correction filters (`_sensor_correction`) delay the motion by a third of a millisecond. A sample is used six
samples later, when drop-outs are known. The filter also corrects the accelerometer's AC coupling. All
functions return without waiting.
"""

import hashlib
import math
from collections import deque
from collections.abc import Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import ClassVar

import numpy as np
from pydantic import ValidationError

from vibench.acquisition.recording import DROPOUT_DELAY_S, bridge, find_dropouts
from vibench.acquisition.rig import Rig, channels_of, specimen_of
from vibench.sim import FrozenModel, Specimen
from vibench.sim.operating_system.this import replace_file, state_folder

from ..recordings.channels import BASE, RESPONSE
from ..signals import Reals
from ..tables import Tabular
from . import _tracking as tracking
from ._found_parameters import FoundParameter, FoundSpecimen, found_specimen
from ._prepared_motion import (
    HALF_LENGTH,
    ChannelNoise,
    PreparedMotion,
    dropout_samples,
    require_channels,
    sensor_correction,
    white_noise,
)
from ._tracking_model import (
    STATES,
    VX,
    Hidden,
    W,
    X,
    Y,
    Z,
    equations,
    exact_flow,
    tracked_specimen,
    with_values,
)

AHEAD_S = 0.04
LEARNT_S = 0.15
"""Length of motion to which the model of the base is fitted [s]."""
_HARMONICS = 3
_YIELDING = (X, VX, W)
"""States that act on the base: the specimen pushes the table through k0 and c0."""
_BIN_S = 1e-3
_WITHIN = 0.68
_FEWEST, _MOST = 5, 40
"""Smallest and largest number of recent forecasts from which the forecast error is estimated."""
_NOT_MEASURED = 1e30
"""Variance assigned to a missing sample."""


@dataclass(frozen=True, eq=False)
class Forecast(Tabular):
    """Forecast of p, one value per sample."""

    OWN_UNITS: ClassVar = {"p": "m", "error": "m"}

    first: int
    """Index of the first forecast sample, counted from the start of the recording."""
    p: Reals
    """Relative displacement p = y - z [m]."""
    error: Reals
    """Error that 68 % of recent forecasts did not exceed at this horizon [m]; NaN with too few forecasts."""


class Forecaster:
    """Forecasts of p, and their observed errors."""

    def __init__(self, sample_rate_hz: float) -> None:
        self._bin = max(1, round(_BIN_S * sample_rate_hz))
        self._count = self._bin * round(AHEAD_S / _BIN_S)
        self._errors: deque[Reals] = deque(maxlen=_MOST)
        self._pending: deque[tuple[int, Reals]] = deque(maxlen=8)

    def forecast(
        self,
        model: tracking.MotionModel,
        motion: PreparedMotion,
        at: tracking.FilterState,
        states: Reals,
        frequency_hz: float,
    ) -> Forecast | None:
        """Return the forecast of p after ``at``; ``states`` contains the states at the newest samples.

        None if the filter cannot follow the forecast base motion to the end.
        """
        rate = motion.sample_rate_hz
        numbers = motion.first_sample + at.sample - np.arange(states.shape[0] - 1, -1, -1)
        turned = 2 * np.pi * frequency_hz / rate
        matrix = np.column_stack([*_tones(turned * numbers), states[:, _YIELDING]])
        scale = np.sqrt(np.mean(matrix**2, axis=0)) + np.finfo(float).tiny
        stop = at.sample + 1
        accelerations = motion.accelerations(stop - len(matrix), stop)
        weights = np.linalg.lstsq(matrix / scale, accelerations, rcond=1e-9)[0] / scale
        ahead = numbers[-1] + np.arange(self._count + 1)
        tone = _tones(turned * ahead).T @ weights[: 2 * _HARMONICS]
        yielding = _on_a_table(model, motion, weights[2 * _HARMONICS :])
        coming = replace(motion, acceleration=tone, velocity=np.zeros(tone.size))
        start = tracking.FilterState(0, at.state[:STATES].copy(), at.covariance[:STATES, :STATES].copy())
        run = tracking.run_filter(yielding, coming, start, self._count)
        if run.states.shape[0] < self._count:
            return None
        p = run.states[:, Y] - run.states[:, Z]
        self._pending.append((int(numbers[-1]) + 1, p))
        return Forecast(int(numbers[-1]) + 1, p, self._usual_error())

    def _usual_error(self) -> Reals:
        if len(self._errors) < _FEWEST:
            return np.full(self._count, np.nan)
        usual = np.quantile(np.array(self._errors), _WITHIN, axis=0)
        return np.asarray(np.repeat(np.maximum.accumulate(usual), self._bin))

    def compare(self, first: int, p: Reals) -> None:
        """Compare forecasts with the tracked ``p`` from sample ``first`` on; ``p`` is NaN without a track."""
        while self._pending and self._pending[0][0] + self._count <= first + p.size:
            begin, forecast = self._pending.popleft()
            if begin < first:
                continue
            error = (forecast - p[begin - first : begin - first + self._count]) ** 2
            if not np.isnan(error).any():
                self._errors.append(np.sqrt(error.reshape(-1, self._bin).mean(axis=1)))


def _tones(turns: Reals) -> Reals:
    """Return sine and cosine of the drive and its harmonics, shape (2 harmonics, samples)."""
    return np.concatenate([(np.sin(n * turns), np.cos(n * turns)) for n in range(1, _HARMONICS + 1)])


def _on_a_table(model: tracking.MotionModel, motion: PreparedMotion, weights: Reals) -> tracking.MotionModel:
    """Return the model with the fitted reaction of the specimen on the base."""
    a, base, _ = equations(model.specimen, motion.coupling_rad_per_s)
    a[:, _YIELDING] += np.outer(base, weights)
    tables = model.tables
    flow, small_flow = (exact_flow(a, base, tables.step_s / parts) for parts in (1, tables.small_steps))
    return replace(
        model,
        tables=replace(tables, flow=flow, small_flow=small_flow),
        velocity_variance=_NOT_MEASURED,
    )


# Changes of the specimen are detected by comparing the innovations of a track with a baseline.
#
# Each block of 0.1 s is within the usual level or outside. Page's test (CUSUM, Biometrika 41, 100, 1954) sums
# the log likelihood ratio of two hypotheses: half of all blocks are outside, or one block in a hundred is. If
# at most one block in a hundred is outside without a change, the mean time between false alarms is at least
# exp(threshold) blocks (Lorden, Ann. Math. Stat. 42, 1897, 1971). This time is set to `FALSE_ALARM_S`. Five
# consecutive blocks outside also raise an alarm.

BLOCK_S = 0.1
FALSE_ALARM_S = 1000 * 3600.0
"""Smallest mean time between false alarms [s]."""
OUT_BY_CHANCE = 0.01
"""Largest fraction of blocks outside the usual level while the specimen is unchanged."""
_OUT_WHEN_CHANGED = 0.5
_OUT_ADDS = math.log(_OUT_WHEN_CHANGED / OUT_BY_CHANCE)
_IN_ADDS = math.log((1.0 - _OUT_WHEN_CHANGED) / (1.0 - OUT_BY_CHANCE))
THRESHOLD = math.log(FALSE_ALARM_S / BLOCK_S)
_CALIBRATING = 20
"""Number of blocks from which the usual innovation level is learnt."""
_LARGER, _SCATTERS = 1.5, 8.0
"""A block is unusual if its level exceeds both 1.5 times the usual level and the usual level plus 8 sd."""
_FOLDER = "hidden_motion"
_HASH_DIGITS = 16


class Level(FrozenModel):
    """Usual innovation level of blocks: mean squared normalised innovation in flight, outliers clipped."""

    mean: float
    sd: float
    """Standard deviation of the innovation level between blocks."""

    @property
    def limit(self) -> float:
        """Innovation level above which a block is outside the usual level."""
        return max(_LARGER * self.mean, self.mean + _SCATTERS * self.sd)


class KnownNumber(FrozenModel):
    """A parameter of the specimen with its 95 % bounds."""

    value: float
    low: float
    high: float


class Baseline(FrozenModel):
    """Reference state of a specimen on its bench."""

    bench: str
    since: datetime
    numbers: Mapping[Hidden, KnownNumber]
    """Parameters found from collisions."""
    levels: Mapping[str, Level]
    """Usual innovation levels, keyed by excitation."""


def baseline_path(rig: Rig, specimen: Specimen) -> Path:
    """Return the baseline file of a specimen on a bench, in the user's state folder."""
    digest = hashlib.sha256(f"{rig.name}\n{specimen!r}".encode()).hexdigest()[:_HASH_DIGITS]
    return state_folder() / _FOLDER / f"{digest}.json"


def kept_baseline(path: Path) -> Baseline | None:
    """Read a baseline; None if it is missing or unreadable by this version."""
    try:
        return Baseline.model_validate_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValidationError):
        return None


def keep_baseline(baseline: Baseline, path: Path) -> None:
    """Replace the stored baseline; raises OSError when the folder cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replace_file(path) as coming:
        coming.write_text(baseline.model_dump_json(indent=2), encoding="utf-8")


class ChangeWatch:
    """Test whether the innovation levels of blocks have left their usual level."""

    def __init__(self, usual: Level | None = None) -> None:
        """Start with the stored usual level; without it, learn the usual level from the first two seconds."""
        self.usual = usual
        self._learnt: list[float] = []
        self._sum = 0.0
        self.has_changed = False

    def take(self, level: float) -> bool:
        """Add a block's innovation level, infinite for a lost track; return whether to raise the alarm."""
        if self.usual is None:
            if math.isfinite(level):
                self._learnt.append(level)
            if len(self._learnt) == _CALIBRATING:
                self.usual = Level(mean=float(np.mean(self._learnt)), sd=float(np.std(self._learnt, ddof=1)))
            return False
        added = _OUT_ADDS if level > self.usual.limit else _IN_ADDS
        self._sum = max(0.0, self._sum + added)
        is_alarm = self._sum >= THRESHOLD and not self.has_changed
        self.has_changed = self.has_changed or is_alarm
        return is_alarm


class LiveState(StrEnum):
    """State of the live hidden motion."""

    WAITING = "waiting"
    """There are too few samples, or the motion is too small, to start a track."""
    TRACKED = "tracked"
    LOST = "lost"
    """The measured motion does not fit the parameters; no hidden motion is shown."""


@dataclass(frozen=True, eq=False)
class LiveMotion(Tabular):
    """Newest part of the hidden motion, for a picture."""

    OWN_UNITS: ClassVar = {"p": "m"}

    state: LiveState
    why: str
    """Reason why the motion is not tracked."""
    first: int
    """Index of the first sample of ``p``, counted from the start of the recording."""
    p: Reals
    """Relative displacement, NaN without a track [m]."""
    forecast: Forecast | None
    """Forecast of p; only for a sine drive."""
    gaps_m: tuple[float, float]
    level: float
    """Innovation level of the last block; 1 if only noise remains."""
    limit: float
    """Innovation level above which a block counts as unusual; NaN while the usual level is learnt."""


HELD_S = 3.0
"""Length of the newest motion that is stored for finding parameters [s]."""
_NOISE_S = 0.5
_LOOKED_S = 0.25
"""Length of the newest stretch that is searched for drop-outs [s]."""
_FIND_S = 2.4
"""Length of motion from which parameters are found [s]."""
_PATIENCE = 2.0
"""Factor by which the wait between parameter searches grows with every search."""
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.05, 0.4
"""First and longest time between attempts to start a track while the motion does not fit [s]."""
_CLIPPED = 25.0
"""Value at which squared innovations are clipped, so that one late impact does not count as a change."""
_STEADY = (Hidden.LOWER_GAP, Hidden.UPPER_GAP, Hidden.M1)
_APART = 3.0
"""Smallest reported change of a parameter, relative to the root sum square of both bounds' half widths."""


class LiveTwin:
    """Track m1 live, find its parameters, and detect changes.

    Pass every stretch of samples to `take` once and in order; it returns sentences about changes. `newest`
    returns data for a picture.
    """

    def __init__(
        self,
        rig: Rig,
        sample_rate_hz: float,
        executor: Executor,
        specimen: Specimen | None = None,
        known: dict[Hidden, KnownNumber] | None = None,
    ) -> None:
        """Start without samples.

        Raises InvalidRequest when the specimen's stops cannot be tracked; UnusableData when one of the two
        channels is missing.

        Parameters
        ----------
        rig
            The bench with its sensors, and the default specimen.
        sample_rate_hz
            Sample rate of both channels.
        executor
            Runs the search for parameters (one second of computing) during tracking.
        specimen
            Description of the specimen.
        known
            Parameters of the specimen's baseline, which replace the described ones.
        """
        channels = {each.role.value: each for each in channels_of(rig)}
        require_channels(rig.name, tuple(channels))
        self._described = tracked_specimen(specimen_of(rig) if specimen is None else specimen)
        self._known = dict(known or {})
        self._tracked = with_values(self._described, {n: each.value for n, each in self._known.items()})
        self._correction = sensor_correction(
            rig.model_dump(mode="json"), channels[BASE], channels[RESPONSE], sample_rate_hz
        )
        self._rate = sample_rate_hz
        self._block = round(BLOCK_S * sample_rate_hz)
        self._executor = executor
        self._finding: Future[FoundSpecimen] | None = None
        self.found: tuple[FoundParameter, ...] = ()
        """Latest parameters found in this run; empty if no parameters were found yet."""
        self.watch = ChangeWatch()
        self._begin_anew(0)

    def warm_up(self) -> None:
        """Load the native library before the first sample, to avoid a delay later."""
        count = round(4 * tracking.ACQUISITION_S * self._rate)
        noise = 1e-3 * np.random.default_rng(1).standard_normal((2, count))
        self.take(0, noise[0], noise[1])
        assert self._motion.samples > 0
        model = tracking.motion_model(self._tracked, self._motion)
        at = tracking.FilterState(0, np.zeros(STATES), np.eye(STATES) * 1e-12)
        tracking.run_filter(model, self._motion, at, 1, loss_limit=tracking.LOSS_LIMIT)
        self._begin_anew(0)

    def begin_run(self, usual: Level | None) -> None:
        """Discard the last motion but keep its parameters; ``usual`` is the new excitation's usual level."""
        self.watch = ChangeWatch(usual)
        self.found = ()
        self._begin_anew(0)

    def _begin_anew(self, sample: int) -> None:
        self.next_sample = sample
        """Index of the next sample, counted from the start of the recording."""
        self._raw, self._used = np.empty((2, 0)), HALF_LENGTH
        nothing = np.empty(0)
        self._motion = PreparedMotion(
            nothing,
            nothing,
            np.empty(0, dtype=np.bool_),
            self._rate,
            self._correction.coupling_rad_per_s,
            sample + HALF_LENGTH,
            ChannelNoise(1.0, 1.0),
        )
        self._states = np.empty((0, STATES))
        self._at: tracking.FilterState | None = None
        self._model: tracking.MotionModel | None = None
        self._state, self._why = LiveState.WAITING, "too few samples so far to begin tracking"
        self._looked = self._pause = 0
        self._find_at = sample + round(_FIND_S * self._rate)
        self._wait = round(_FIND_S * self._rate)
        self._squares: list[Reals] = []
        self._block_end = sample + self._block
        self._is_out = False
        self._level = np.nan
        self._forecaster = Forecaster(self._rate)
        self._forecast: Forecast | None = None

    @property
    def newest(self) -> LiveMotion:
        """Return p of the stored motion, and the forecast of p."""
        limit = np.nan if self.watch.usual is None else self.watch.usual.limit
        return LiveMotion(
            self._state,
            self._why,
            self._motion.first_sample,
            self._states[:, 1] - self._states[:, 2],
            self._forecast,
            self._tracked.specimen.gaps_m,
            self._level,
            limit,
        )

    def take(
        self, first_sample: int, acceleration: Reals, velocity: Reals, frequency_hz: float | None = None
    ) -> tuple[str, ...]:
        """Add the next samples; return sentences on changes. Tracking restarts after lost samples.

        Parameters
        ----------
        first_sample
            Index of the first of these samples, counted from the start of the recording.
        acceleration, velocity
            Acceleration of the base [m/s2] and velocity of m0 [m/s], shape (samples,).
        frequency_hz
            Frequency of a sine excitation, for a forecast; otherwise None.
        """
        if first_sample != self.next_sample:
            self._begin_anew(first_sample)
        if not np.isfinite(acceleration).all() or not np.isfinite(velocity).all():
            self._begin_anew(first_sample + acceleration.size)
            return ()
        self.next_sample = first_sample + acceleration.size
        self._append(acceleration, velocity)
        sentences: list[str] = []
        self._follow(sentences)
        self._find(sentences)
        self._make_forecast(frequency_hz)
        return tuple(sentences)

    def _append(self, acceleration: Reals, velocity: Reals) -> None:
        """Correct and store new samples; drop the oldest samples."""
        self._raw = np.concatenate([self._raw, (acceleration, velocity)], axis=1)
        first, stop = self._used, self._raw.shape[1] - HALF_LENGTH - round(DROPOUT_DELAY_S * self._rate)
        if stop <= first:
            return
        dropouts = find_dropouts(self._raw[1], self._rate)
        around = slice(first - HALF_LENGTH, stop + HALF_LENGTH)
        seen = self._correction.correct(self._raw[0, around], bridge(self._raw[1], dropouts)[around])
        new = [each[HALF_LENGTH:-HALF_LENGTH] for each in seen]
        is_dropout = dropout_samples(dropouts, first, stop)
        surplus = max(0, stop - round(_LOOKED_S * self._rate))
        self._raw, self._used = self._raw[:, surplus:], stop - surplus
        held = self._motion
        surplus = max(0, held.samples + new[0].size - round(HELD_S * self._rate))
        self._motion = replace(
            held,
            acceleration=np.concatenate([held.acceleration, new[0]])[surplus:],
            velocity=np.concatenate([held.velocity, new[1]])[surplus:],
            is_dropout=np.concatenate([held.is_dropout, is_dropout])[surplus:],
            first_sample=held.first_sample + surplus,
        )
        unknown = np.full((new[0].size, STATES), np.nan)
        self._states = np.concatenate([self._states, unknown])[surplus:]
        self._looked = max(0, self._looked - surplus)
        if self._at is not None:
            self._at.sample -= surplus

    def _follow(self, sentences: list[str]) -> None:
        """Track up to the newest sample, and test every complete block for changes."""
        motion = self._motion
        while True:
            if self._at is None:
                self._acquire()
            end = min(self._block_end - motion.first_sample, motion.samples)
            if self._at is not None and self._at.sample < end - 1:
                self._advance(self._at, end - 1 - self._at.sample)
            if motion.first_sample + motion.samples < self._block_end:
                return
            self._block_end += self._block
            self._check_block(sentences)

    def _acquire(self) -> None:
        motion = self._motion
        window = round(tracking.ACQUISITION_S * self._rate)
        first = motion.samples - 2 - window
        if first < self._looked:
            return
        # A track starts in the window's middle third. Try again a third later, so that this third is new.
        self._looked = first + max(window // 3, self._pause)
        part = slice(max(0, motion.samples - round(_NOISE_S * self._rate)), None)
        if motion.samples < 2 * window:
            return
        noise = ChannelNoise(white_noise(motion.acceleration[part]), white_noise(motion.velocity[part]))
        self._motion = replace(motion, noise=noise)
        model = tracking.motion_model(self._tracked, self._motion)
        begun = tracking.acquire(model, self._motion, first)
        match begun:
            case str():
                is_misfit = "equations" in begun
                self._state = LiveState.LOST if is_misfit else LiveState.WAITING
                self._why = begun
                if is_misfit:
                    self._wait_longer()
            case tracking.FilterState():
                self._at, self._model = begun, model
                self._state, self._why = LiveState.TRACKED, ""

    def _advance(self, at: tracking.FilterState, count: int) -> None:
        assert self._model is not None
        begin = at.sample + 1
        run = tracking.run_filter(self._model, self._motion, at, count, loss_limit=tracking.LOSS_LIMIT)
        kept = run.states.shape[0]
        if kept < count:
            kept = tracking.reliable_samples(run, self._rate)
            self._at, self._is_out = None, True
            self._state, self._why = LiveState.LOST, "the motion does not fit the specimen model"
            self._wait_longer()
        self._states[begin : begin + kept] = run.states[:kept]
        in_flight = run.nis[~np.isnan(run.nis)]
        self._squares.append(np.asarray(np.minimum(in_flight, _CLIPPED)))

    def _wait_longer(self) -> None:
        """Retry the start of a track at once, then less and less often, to limit the computing load."""
        longest = round(_LONGEST_PAUSE_S * self._rate)
        self._pause = min(2 * self._pause + round(_FIRST_PAUSE_S * self._rate), longest)

    def _check_block(self, sentences: list[str]) -> None:
        """Compare the innovation level of the finished block with the usual level."""
        squares = np.concatenate(self._squares or [np.empty(0)])
        self._squares = []
        is_out, self._is_out = self._is_out or self._state is LiveState.LOST, False
        if not is_out:
            self._pause = 0
        if not is_out and squares.size < self._block // 4:
            return
        self._level = np.inf if is_out else float(squares.mean())
        # Before any parameter is known, a misfit may come from a wrong description instead of a change.
        if (self._known or self.found) and self.watch.take(self._level):
            time_s = self._block_end / self._rate
            sentences.append(
                f"The specimen changed at {time_s:.1f} s: the measured motion no longer fits the specimen's "
                f"parameters (innovation {'lost' if is_out else f'{self._level:.3g}'}, usually "
                f"{self.watch.usual.mean if self.watch.usual else np.nan:.3g})."
            )
            # End a running search, because it uses samples from before the change.
            self._finding = None
            self._wait = round(_FIND_S * self._rate)
            self._find_at = self.next_sample + self._wait

    def _find(self, sentences: list[str]) -> None:
        """Use the result of a finished parameter search; start the next search in parallel with tracking."""
        if self._finding is not None and self._finding.done():
            finding, self._finding = self._finding, None
            self._use_found(finding.result(), sentences)
        enough = self._motion.samples >= round(_FIND_S * self._rate)
        is_quiet = self._state is LiveState.WAITING
        if self._finding is None and enough and not is_quiet and self.next_sample >= self._find_at:
            stop = self._motion.samples
            part = self._motion.part(stop - round(_FIND_S * self._rate), stop)
            self._finding = self._executor.submit(found_specimen, self._tracked, part)
            self._wait = round(_PATIENCE * self._wait)
            self._find_at = self.next_sample + self._wait

    def _use_found(self, found: FoundSpecimen, sentences: list[str]) -> None:
        parameters = {each.what: each for each in found.parameters if each.is_determined}
        if not parameters:
            return
        if Hidden.LOWER_GAP in parameters or Hidden.UPPER_GAP in parameters:
            self._find_at = np.iinfo(np.int64).max
        # Even if the specimen does not change, its dampers and contact law depend on the drive level.
        compared = (
            parameters.values()
            if self.watch.has_changed
            else [parameters[each] for each in _STEADY if each in parameters]
        )
        changed = [each for each in compared if self._is_other(each)]
        for each in changed:
            label, value, _ = each.row
            before = replace(each, value=(was := self._known[each.what]).value, low=was.low, high=was.high)
            sentences.append(f"The specimen's {label} is {value}; it was {before.row[1]}.")
        is_first = not self._known and not self.found
        self.found = tuple(found.parameters)
        if is_first or changed or self.watch.has_changed:
            self._known |= {
                each.what: KnownNumber(value=each.value, low=each.low, high=each.high)
                for each in parameters.values()
            }
            self._tracked = found.tracked
            if self._at is not None:
                self._model = tracking.motion_model(found.tracked, self._motion)
            self.watch = ChangeWatch()

    def _is_other(self, found: FoundParameter) -> bool:
        before = self._known.get(found.what)
        return before is not None and abs(found.value - before.value) > _APART * float(
            np.hypot(found.half_width, 0.5 * (before.high - before.low))
        )

    @property
    def numbers(self) -> dict[Hidden, KnownNumber]:
        """Parameters that were found from collisions and are used for tracking."""
        return dict(self._known)

    def _make_forecast(self, frequency_hz: float | None) -> None:
        motion, at = self._motion, self._at
        self._forecaster.compare(motion.first_sample, self._states[:, 1] - self._states[:, 2])
        self._forecast = None
        count = round(LEARNT_S * self._rate)
        if at is None or self._model is None or frequency_hz is None or at.sample < count:
            return
        states = self._states[at.sample + 1 - count : at.sample + 1]
        if not np.isnan(states[:, 0]).any():
            self._forecast = self._forecaster.forecast(self._model, motion, at, states, frequency_hz)
