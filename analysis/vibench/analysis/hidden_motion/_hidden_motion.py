"""Motion of m1 against m2 (hidden motion) in one recording, by tracking and without a contact model."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import maximum_filter1d

from vibench.acquisition.recording import Recording, ResultArray
from vibench.sim import Specimen
from vibench.sim.background import Observer, ignore_progress, stage

from ..errors import InvalidRequest, UnusableData
from ..recordings.channels import BASE, RESPONSE, ResponseChannel, response_roles
from ..recordings.facts import require_checked, require_usable, specimen_of
from ..signals import Reals, Samples
from ..tables import Tabular, columns, plain, with_unit
from . import _contact_free as contact_free
from ._found_parameters import FoundParameter, FoundSpecimen, found_specimen, without_values
from ._prepared_motion import (
    HALF_LENGTH,
    ChannelNoise,
    PreparedMotion,
    motion_in_samples,
    prepared_motion,
    sensor_correction,
    white_noise,
)
from ._tracking import MotionModel, TrackedPiece, TrackGap, follow, motion_model
from ._tracking_model import VY, VZ, Hidden, Numbers, TrackedSpecimen, W, tracked_specimen

_RATES = {"m1": VY, "m2": VZ}
_MOST_EXCESS = 1.25
"""Largest ratio of a sensor's mean squared deviation from the track to the expected squared deviation."""
_ALLOWED = 0.02
"""Allowed relative deviation of a sensor from the track due to mounting, alignment and local modes."""
_MOST_EXPECTED = 0.2
"""Largest expected deviation for a verdict; impacts act as noise in an accelerometer on a colliding mass."""
_MOST_SCALE = 0.05
"""Largest deviation of measured / tracked velocity from 1; calibrations may err by a few per cent."""


@dataclass(frozen=True)
class MassCheck:
    """Comparison of the measured velocity of m1 or m2 with the tracked velocity."""

    channel: str
    scale: float
    """Ratio of measured to tracked velocity."""
    unexplained: float
    """Part of the measured velocity that the track does not explain (relative rms)."""
    expected: float
    """Unexplained part that noise, uncertainty of the track and mounting of the sensor would cause."""

    @property
    def confirms(self) -> bool | None:
        """Whether the track explains the measured velocity; None if the sensor is not accurate enough."""
        if not self.expected <= _MOST_EXPECTED:
            return None
        return self.unexplained**2 <= _MOST_EXCESS * self.expected**2 and abs(self.scale - 1) <= _MOST_SCALE

    @property
    def sentence(self) -> str:
        """Return the comparison with the track as a sentence with its numbers."""
        verdict = {True: "confirms", False: "refutes", None: "neither confirms nor refutes"}[self.confirms]
        return (
            f"The measured {self.channel} {verdict} the track: "
            f"{100 * self.unexplained:.2g} % of its rms is not explained ({100 * self.expected:.2g} % is "
            f"expected), and its amplitude is {self.scale:.3f} times the amplitude of the track."
        )


@dataclass
class MeasuredMass:
    """A sensor on m1 or m2 during a motion, compared with the pieces of a track."""

    channel: str
    velocity: Reals
    """Measured velocity of m1 or m2 [m/s], shape (samples,); NaN where unknown."""
    noise: float
    """RMS noise of the measured velocity [m/s]."""
    _sums: Reals = field(default_factory=lambda: np.zeros(5))

    def add(self, piece: TrackedPiece) -> None:
        """Add a piece, without the samples near collisions, where a converter's filter rings."""
        measured = self.velocity[piece.first : piece.stop]
        touched = maximum_filter1d(piece.smoothed.touched.astype(np.uint8), 2 * HALF_LENGTH + 1)
        used = np.isfinite(measured) & (touched == 0)
        places = [_RATES[self.channel[:2]], W]
        tracked = piece.smoothed.states[used][:, places].sum(axis=1)
        # Use the variance of the filter's predictions, not the smaller variance of the smoother.
        variance = piece.run.covariances[used][:, places][:, :, places].sum(axis=(1, 2))
        measured = measured[used]
        self._sums += (
            measured.size,
            measured @ measured,
            measured @ tracked,
            tracked @ tracked,
            variance.sum(),
        )

    def check(self, level: float) -> MassCheck | None:
        """Return the comparison, or None without samples. A ``level`` above 1 widens the track's variance."""
        count, measured, both, tracked, variance = self._sums.tolist()
        if not count or not measured or not tracked:
            return None
        expected = max(1.0, level) * variance + count * self.noise**2
        return MassCheck(
            self.channel,
            both / tracked,
            float(np.sqrt(max(0.0, 1.0 - both**2 / (tracked * measured)))),
            float(np.sqrt(expected / measured + _ALLOWED**2)),
        )


def measured_masses(recording: Recording, motion: PreparedMotion) -> Iterator[MeasuredMass]:
    """Yield the signals of sensors on m1 and m2 during a motion, corrected for sensor dynamics."""
    rate_hz, start = motion.sample_rate_hz, motion.first_sample
    stop = start + motion.samples
    for role in response_roles(recording):
        if role[:2] not in _RATES:
            continue
        try:
            channel = ResponseChannel(recording, role)
        except UnusableData:  # the acceleration is too short to be integrated
            continue
        weights = sensor_correction(
            recording.bench, recording.channel(BASE), recording.channel(role), rate_hz
        ).velocity
        heard = channel.read(start, stop)
        noise = white_noise(np.nan_to_num(recording.read(role, start, stop))) * channel.noise_gain
        yield MeasuredMass(role, np.convolve(heard - np.nanmean(heard), weights, "same"), noise)


MICRO = 1e6
_LEAST_HELD = 0.95
"""Smallest fraction of a motion that is tracked if the parameters are correct."""
_HIGHEST_LEVEL = 1.25
"""Largest mean squared innovation in flight if the parameters are correct; 0.8 to 1.1 are usual."""


@dataclass(frozen=True, eq=False)
class TrackedMotion(Tabular):
    """p tracked by the extended Kalman filter and smoothed; NaN where the track was lost."""

    OWN_UNITS: ClassVar = {"p": "m", "rate": "m s-1", "p_sd": "m"}

    p: Samples
    """Relative displacement y - z, shape (samples,) [m]."""
    rate: Samples
    """Rate of change of p [m/s]."""
    p_sd: Samples
    """Standard deviation of p [m]."""
    collisions: contact_free.Collisions
    not_followed: tuple[TrackGap, ...]
    innovation_level: float
    """Mean squared normalised innovation in flight; 1 if only noise remains."""

    @property
    def tracked_share(self) -> float:
        """Fraction of the samples that were tracked."""
        return float(np.mean(~np.isnan(self.p)))

    @property
    def median_sd_m(self) -> float | None:
        """Median standard deviation of p; None without a track, or if a sensor refutes the track."""
        known = self.p_sd[~np.isnan(self.p_sd)]
        return float(np.median(known)) if known.size else None


@dataclass(frozen=True, eq=False)
class HiddenMotion(Tabular):
    """Hidden motion estimated from base acceleration and m0's velocity."""

    name: str
    sample_rate_hz: float
    first_sample: int
    """Index of the motion's first sample, counted from the start of the recording."""
    noise: ChannelNoise
    specimen: TrackedSpecimen
    """Parameters used for tracking."""
    found: FoundSpecimen | None
    """Parameters found from collisions; None if the description was used."""
    tracked: TrackedMotion
    free: contact_free.FreeMotion
    free_gaps: tuple[contact_free.FreeGap | None, contact_free.FreeGap | None]
    """Lower and upper gap without a contact model."""
    mass_checks: tuple[MassCheck, ...] = ()
    """Checks of the track against sensors on m1 and m2, if recorded."""

    @property
    def time_s(self) -> Reals:
        """Time since the start of the recording, shape (samples,) [s]."""
        return (self.first_sample + np.arange(self.tracked.p.size)) / self.sample_rate_hz

    @property
    def gaps_m(self) -> tuple[float, float]:
        """Lower and upper gap used for tracking."""
        return self.specimen.specimen.gaps_m

    @property
    def is_confirmed(self) -> bool:
        """Whether parameters were given or found, and no sensor refutes them; if not, bounds are omitted."""
        if any(each.confirms is False for each in self.mass_checks):
            return False
        return self.found is None or any(each.is_determined for each in self.found.parameters)

    @property
    def parameters(self) -> tuple[FoundParameter, ...]:
        """Parameters found from collisions; empty if not requested."""
        return () if self.found is None else self.found.parameters

    def to_dict(self) -> dict[str, object]:
        """Return the results as JSON, without the motion itself."""
        document = {
            **columns(
                self.tracked,
                "share_followed=tracked_share impacts=collisions.count innovation_level p_sd_m=median_sd_m",
            ),
            "measured_masses": [{**asdict(each), "confirms": each.confirms} for each in self.mass_checks],
            "not_followed": [
                {
                    "start_s": (self.first_sample + each.first) / self.sample_rate_hz,
                    "stop_s": (self.first_sample + each.stop) / self.sample_rate_hz,
                    "reason": each.reason,
                }
                for each in self.tracked.not_followed
            ],
            "parameters": {
                each.what.value: {
                    **columns(each if each.is_determined else None, "value low high"),
                    "described": each.described,
                    "not_determined": each.not_determined or None,
                }
                for each in self.parameters
            },
            "without_contact_model": {
                "share_told": self.free.share_told,
                "impacts": int(self.free.impacts.samples.size),
                "gaps_m": [gap and gap.value_m for gap in self.free_gaps],
                "gaps_sd_m": [gap and (gap.sd_m if self.is_confirmed else None) for gap in self.free_gaps],
            },
        }
        return dict(plain(document))

    @property
    def sentences(self) -> tuple[str, ...]:
        """Return sentences on tracked and lost parts, and on the parameters."""
        return tuple(_sentences(self))


def hidden_motion(
    recording: Recording,
    specimen: Specimen | None = None,
    start_s: float = 0.0,
    stop_s: float | None = None,
    numbers: Numbers = Numbers.FOUND,
    observer: Observer = ignore_progress,
) -> HiddenMotion:
    """Estimate the relative motion of m1 and its collisions from base acceleration and m0's velocity.

    The method without a contact model estimates the unknown force on m1 from the linear parameters.
    Tracking uses an extended Kalman filter and a smoother with seven states of the motion and the error of
    the accelerometer; flight is computed exactly. Equations: docs/hidden-motion.md.

    Parameters
    ----------
    recording
        Recording of base acceleration and m0's velocity at 10 kHz or more (51.2 kHz to find the contact law).
    specimen
        Description of the specimen, by default from the recording; m0, m2 and k1 must be exact, the rest
        within a few per cent.
    start_s, stop_s
        Stretch of the recording [s]; by default all of it.
    numbers
        Source of gaps, m1, springs, dampers and contact law: found first, or as described.
    observer
        Receives the progress.

    Raises
    ------
    InvalidRequest
        When the stretch is empty, or the stops of the contact law are rigid.
    UnusableData
        When samples were lost, a channel is missing, the rate is too low, or the recording was changed.
    NotEnoughData
        When the stretch is too short.
    """
    require_checked(recording)
    require_usable(recording, RESPONSE, BASE)
    described = tracked_specimen(specimen_of(recording.bench) if specimen is None else specimen)
    motion = prepared_motion(recording, *_stretch(recording, start_s, stop_s))
    name = recording.path.name.removesuffix(".part").removesuffix(".h5")
    found = None
    if numbers is Numbers.FOUND:
        stage(observer, f"{name}: finding gaps and m1")
        found = found_specimen(described, motion)
    tracked, masses = described if found is None else found.tracked, measured_masses(recording, motion)
    return hidden_motion_of(motion, tracked, found, name, observer, tuple(masses))


def hidden_motion_in_samples(
    base_acceleration: ArrayLike,
    m0_velocity: ArrayLike,
    sample_rate_hz: float,
    specimen: Specimen,
    numbers: Numbers = Numbers.FOUND,
) -> HiddenMotion:
    """Estimate the hidden motion from samples corrected for their sensors; see `hidden_motion`.

    Parameters
    ----------
    base_acceleration
        Acceleration of the base including DC, shape (n,) [m/s2].
    m0_velocity
        Absolute velocity of m0 at the same instants, shape (n,) [m/s].
    sample_rate_hz
        Sample rate of both.
    specimen
        Description of the specimen.
    numbers
        Source of gaps, m1, springs, dampers and contact law: found first, or as described.

    Raises
    ------
    InvalidRequest
        When the arrays differ in length, or the stops of the contact law are rigid.
    UnusableData
        When samples are not finite, or the rate is too low.
    NotEnoughData
        When there are too few samples.
    """
    acceleration, velocity = (np.asarray(each, dtype=np.float64) for each in (base_acceleration, m0_velocity))
    if acceleration.shape != velocity.shape or acceleration.ndim != 1:
        raise InvalidRequest(
            f"arrays of shape {acceleration.shape} for the base and {velocity.shape} for m0 were given; give "
            "one-dimensional arrays of equal length"
        )
    motion = motion_in_samples(acceleration, velocity, sample_rate_hz)
    described = tracked_specimen(specimen)
    found = found_specimen(described, motion) if numbers is Numbers.FOUND else None
    return hidden_motion_of(motion, described if found is None else found.tracked, found, "samples")


def hidden_motion_of(
    motion: PreparedMotion,
    tracked: TrackedSpecimen,
    found: FoundSpecimen | None,
    name: str,
    observer: Observer = ignore_progress,
    masses: Sequence[MeasuredMass] = (),
) -> HiddenMotion:
    """Apply both methods to a prepared motion, and check the track against the sensors in ``masses``."""
    model = motion_model(tracked, motion)
    on_read = stage(observer, f"{name}: tracking the hidden motion")
    followed = _track_motion(motion, model, found, lambda sample: on_read(sample, motion.samples), masses)
    found_checks = (each.check(followed.innovation_level) for each in masses)
    checks = tuple(each for each in found_checks if each is not None)
    why_not = _fault_of_numbers(followed, checks)
    if found is not None and why_not:
        found = without_values(found, why_not)
    on_free = stage(observer, f"{name}: hidden motion without a contact model")
    free = contact_free.free_motion(model, motion, lambda sample: on_free(sample, motion.samples))
    found_motion = HiddenMotion(
        name,
        motion.sample_rate_hz,
        motion.first_sample,
        motion.noise,
        tracked,
        found,
        followed,
        free,
        contact_free.free_gaps(free.impacts),
        checks,
    )
    if found_motion.is_confirmed:
        return found_motion
    if any(each.confirms is False for each in checks):
        refuted = replace(followed, p_sd=np.full_like(followed.p_sd, np.nan))
        found_motion = replace(found_motion, tracked=refuted)
    return replace(found_motion, free=replace(free, p_sd=np.full_like(free.p_sd, np.nan)))


def _stretch(recording: Recording, start_s: float, stop_s: float | None) -> tuple[int, int]:
    rate, end_s = recording.sample_rate_hz, recording.samples / recording.sample_rate_hz
    last_s = end_s if stop_s is None else stop_s
    if not 0.0 <= start_s < last_s:
        raise InvalidRequest(
            f"the part {start_s:g} to {last_s:g} s of {end_s:.3g} s is invalid; give a start and a later end"
        )
    return round(start_s * rate), min(round(last_s * rate), recording.samples)


def _track_motion(
    motion: PreparedMotion,
    model: MotionModel,
    found: FoundSpecimen | None,
    on_progress: Callable[[int], None],
    masses: Sequence[MeasuredMass],
) -> TrackedMotion:
    # Single precision is enough and halves the memory.
    p, rate, sd = (np.full(motion.samples, np.nan, dtype=np.float32) for _ in range(3))
    collisions: list[contact_free.Collisions] = []
    lost: list[TrackGap] = []
    squared, used = 0.0, 0
    for part in follow(model, motion, on_progress):
        match part:
            case TrackedPiece():
                place = slice(part.first, part.stop)
                p[place], rate[place] = part.smoothed.p, part.smoothed.rate
                sd[place] = np.sqrt(part.smoothed.variances[:, 0])
                collisions.append(contact_free.collisions_of(model, motion, part))
                for each in masses:
                    each.add(part)
                here = part.run.nis
                squared += float(np.nansum(here))
                used += int(np.count_nonzero(~np.isnan(here)))
            case TrackGap():
                lost.append(part)
    level = squared / used if used else float("nan")
    sd *= np.float32(np.sqrt(max(1.0, level if used else 1.0)))
    np.hypot(sd, np.float32(_gap_sd(found)), out=sd)
    return TrackedMotion(p, rate, sd, contact_free.join_collisions(collisions), tuple(lost), level)


def _fault_of_numbers(tracked: TrackedMotion, checks: Sequence[MassCheck]) -> str:
    """Return the reason why the parameters do not fit the specimen; empty if they fit."""
    for each in checks:
        if each.confirms is False:
            return f"{each.channel} contradicts tracking with the identified parameters"
    is_tracked = ~np.isnan(tracked.p)
    held = float(np.mean(is_tracked[int(np.argmax(is_tracked)) :]))
    if held < _LEAST_HELD:
        return f"tracking with the identified parameters worked in only {100 * held:.3g} % of the motion"
    if not tracked.innovation_level <= _HIGHEST_LEVEL:
        return (
            f"tracking with the identified parameters leaves a residual of {tracked.innovation_level:.3g} "
            "times the noise"
        )
    return ""


def _gap_sd(found: FoundSpecimen | None) -> float:
    """Return the standard deviation of p due to the gaps: a quarter of the width of the gaps' bounds."""
    if found is None:
        return 0.0
    gaps = (Hidden.LOWER_GAP, Hidden.UPPER_GAP)
    widths = [each.high - each.low for each in found.parameters if each.what in gaps and each.is_determined]
    return max(widths, default=0.0) / 4.0


def parameter_rows(motion: HiddenMotion) -> tuple[tuple[str, str, str], ...]:
    """Return rows of parameters: name, value with 95 % bounds or a reason, and described value."""
    return tuple(each.row for each in motion.parameters)


def _free_sentence(motion: HiddenMotion) -> str:
    text = f"Without a contact model, impacts: {motion.free.impacts.samples.size}"
    for side, gap in zip(("lower", "upper"), motion.free_gaps, strict=True):
        if gap is not None and motion.is_confirmed:
            text += f", {side} gap {with_unit(MICRO * gap.value_m, 2 * MICRO * gap.sd_m, 'µm')}"
        elif gap is not None:
            text += f", {side} gap {MICRO * gap.value_m:.3g} µm"
    if not any(motion.free_gaps):
        return f"{text}; too few to determine a gap."
    no_bounds = "without bounds, because no track confirms the parameters of the specimen"
    return f"{text}." if motion.is_confirmed else f"{text}, {no_bounds}."


def _sentences(motion: HiddenMotion) -> Iterator[str]:
    tracked, rate = motion.tracked, motion.sample_rate_hz
    yield (
        f"{motion.name}: p was tracked in {100 * tracked.tracked_share:.4g} % of "
        f"{tracked.p.size / rate:.3g} s, impacts: {tracked.collisions.count}"
        + (
            ""
            if tracked.median_sd_m is None
            else f"; standard deviation of p {MICRO * tracked.median_sd_m:.2g} µm"
        )
        + "."
    )
    yield from (each.sentence for each in motion.mass_checks)
    for reason in dict.fromkeys(each.reason for each in tracked.not_followed):
        total = sum(each.stop - each.first for each in tracked.not_followed if each.reason == reason)
        yield f"Not tracked for {total / rate:.3g} s: {reason}."
    yield _free_sentence(motion)
    untold: dict[str, list[str]] = {}
    for parameter in motion.parameters:
        label, value, described = parameter.row
        if parameter.is_determined:
            # Write the first letter in upper case, except in symbols such as m1.
            begun = label if label[-1].isdigit() else f"{label[0].upper()}{label[1:]}"
            yield f"{begun}: {value} (described as {described})."
        else:
            untold.setdefault(parameter.not_determined, []).append(label)
    yield from (f"Not determined, {', '.join(labels)}: {why}." for why, labels in untold.items())


RESULT = "hidden_motion"
_SIDE_AND_IMPULSE = {"side": ("sides", "1"), "impulse": ("impulses", "N s")}
_FREE = {**_SIDE_AND_IMPULSE, "p": ("p", "m")}
_TRACKED = {
    **_SIDE_AND_IMPULSE,
    "penetration": ("penetrations_m", "m"),
    "duration": ("durations_s", "s"),
    "speed_before": ("speeds_before", "m s-1"),
    "speed_after": ("speeds_after", "m s-1"),
}


def keep_hidden_motion(recording: Recording, motion: HiddenMotion) -> str:
    """Save a hidden motion in its recording; return the name of the result.

    Exports can include it (`vibench export --results`). Samples without a track are NaN.

    Raises RecordingError when the recording is unfinished or cannot be written.
    """
    tracked, free = motion.tracked, motion.free
    single = {
        "p": (tracked.p, "m"),
        "p_sd": (tracked.p_sd, "m"),
        "p_rate": (tracked.rate, "m s-1"),
        "p_without_contact_model": (free.p, "m"),
        "p_without_contact_model_sd": (free.p_sd, "m"),
    }
    arrays = {
        "time": ResultArray(motion.time_s, "s"),
        **{
            name: ResultArray(values.astype(np.float32, copy=False), unit, ("time",))
            for name, (values, unit) in single.items()
        },
        **_impacts(motion, "impact", tracked.collisions, _TRACKED),
        **_impacts(motion, "free_impact", free.impacts, _FREE),
    }
    settings = {"told": motion.to_dict(), "sentences": list(motion.sentences)}
    return recording.save_results(RESULT, arrays, settings, (BASE, RESPONSE))


def _impacts(
    motion: HiddenMotion,
    name: str,
    found: contact_free.Collisions | contact_free.FreeImpacts,
    quantities: Mapping[str, tuple[str, str]],
) -> dict[str, ResultArray]:
    """Return the times of impacts, and their quantities, each with its attribute and its unit."""
    axis = f"{name}_time"
    return {
        axis: ResultArray((motion.first_sample + found.samples) / motion.sample_rate_hz, "s"),
        **{
            f"{name}_{ending}": ResultArray(getattr(found, attribute), unit, (axis,))
            for ending, (attribute, unit) in quantities.items()
        },
    }
