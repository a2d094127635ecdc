"""Controller that follows a branch: it predicts along the arc, and corrects until the base moves as a sine.

Small perturbations of the drive show whether the motion would be stable without feedback.
"""

from collections.abc import Generator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import degrees, isfinite, nan, pi

import numpy as np

from vibench.acquisition.control.control_action import ControlAction, Controller, PhaseSamples
from vibench.acquisition.control.feedback_channels import FeedbackChannels, require_answer
from vibench.acquisition.control.sine_loop import SineLoop
from vibench.acquisition.excitation.steps import Segment
from vibench.acquisition.instruments import Samples
from vibench.acquisition.plan import HUSH_S, Phase, RunState, ramp
from vibench.acquisition.recording import (
    BranchEnd,
    BranchEndNote,
    BranchPointNote,
    BranchStabilityNote,
    Stability,
)

from .branch_continuation import BranchContinuation
from .branch_solver import (
    BranchSolver,
    Coefficients,
    LoopSetting,
    MeasuredPoint,
    PredictedPoint,
    Vector,
    is_new,
    noise_of,
    residual_of,
)
from .fast_loop import FastLoop, fast_loop, level_at, require_held
from .open_loop_multiplier import (
    OpenLoopMultiplier,
    PerturbedMotion,
    envelope_deviation,
    open_loop_multiplier,
)
from .protocol import LoopBlock, LoopProgram, ProgramTone

_BLOCK_PERIODS = 10
_GLIDE_S = 0.1
_HIGHEST = 9
_MOST_LOOKS = 20
_KNOWN, _KNOWN_HARMONIC, _KNOWN_RATIO = 0.1, 0.2, 0.02
"""Largest standard errors at the end of a measurement: for fundamental and harmonics of the base, relative
to the tolerance; for m0, relative to m0's amplitude."""
_ROUGHLY = 0.15
"""Largest standard error of the base motion while far from the level, relative to the distance from it."""
_DRIFT = 3.0
"""Largest difference between the two halves of the settled blocks, in standard errors."""
_REMEMBERED = 0.8
"""Weight of the scatter in earlier measurements; a few blocks of one measurement may agree by chance."""


@dataclass(frozen=True, eq=False)
class LoopLook:
    """Response of base and m0 to a setting: mean harmonics over blocks, starting with the first harmonic."""

    base_m: Coefficients
    m0_m: Coefficients
    base_u: Vector
    """Standard error of real and imaginary part of each coefficient [m]."""
    m0_u: Vector

    @property
    def ratio(self) -> complex:
        """Ratio of the fundamentals of m0 and base."""
        return complex(self.m0_m[0] / self.base_m[0])

    @property
    def ratio_u(self) -> float:
        """Standard error of the real and of the imaginary part of `ratio`."""
        shares = self.m0_u[0] / abs(self.m0_m[0]), self.base_u[0] / abs(self.base_m[0])
        return float(abs(self.ratio) * np.hypot(*shares))


class BranchPlayer:
    """Player of controller settings, which measures the response of base and m0 to each setting."""

    def __init__(self, loop: SineLoop, plan: BranchContinuation, fast: FastLoop) -> None:
        self.plan = plan
        self.fast = fast
        self.run = loop.run_phase
        self._most_vpp = loop.most_vpp
        self._feedback = fast.feedback
        self._blocks: list[LoopBlock] = []
        """Blocks of coefficients measured at the current setting since the motion settled."""
        self._squares, self._degrees = np.zeros(1), 0.0
        """Sum of squared deviations of blocks in earlier measurements, and the sum's degrees of freedom."""

    def tone(self, setting: LoopSetting, glide_s: float = _GLIDE_S) -> ProgramTone:
        """Convert a setting to a program of the controller."""
        program = LoopProgram(
            frequency_hz=setting.frequency_hz,
            reference_v=tuple((float(each.real), float(each.imag)) for each in setting.reference_v),
            feedback=self._feedback,
            glide_s=glide_s,
            block_periods=_BLOCK_PERIODS,
            harmonics=max(_HIGHEST, self.plan.harmonics),
        )
        level = 2 * abs(setting.reference_v[0]) / self._most_vpp
        return ProgramTone(setting.frequency_hz, min(float(level), 1.0), program)

    def measure(
        self, setting: LoopSetting, level_m: float
    ) -> Generator[ControlAction, PhaseSamples, LoopLook]:
        """Play a setting, and average until the standard errors are small enough; return the response."""
        tone, frequency_hz = self.tone(setting), setting.frequency_hz
        look_s = self.plan.look_periods / frequency_hz
        samples = yield from self.run(Phase(RunState.SETTLING, tone, self.plan.settle_s + look_s))
        self._blocks = list(samples.coefficients)[-max(2, self.plan.look_periods // _BLOCK_PERIODS) :]
        look, squares, degrees = self._average(frequency_hz)
        for _ in range(_MOST_LOOKS - 1):
            if _is_known(look, level_m, self.plan):
                break
            samples = yield from self.run(Phase(RunState.SETTLING, tone, look_s))
            self._blocks += samples.coefficients
            look, squares, degrees = self._average(frequency_hz)
        self._squares = _REMEMBERED * (self._squares + squares)
        self._degrees = _REMEMBERED * (self._degrees + degrees)
        acceleration = abs(look.base_m[0]) * (2 * pi * frequency_hz) ** 2
        require_answer(self.fast.rig, frequency_hz, 2 * abs(setting.reference_v[0]) * 0.1, acceleration)
        return look

    def record(
        self, setting: LoopSetting, segment: Segment
    ) -> Generator[ControlAction, PhaseSamples, LoopLook]:
        """Record the current setting; return the average over the recording and the preceding measurement."""
        tone = self.tone(setting)
        samples = yield from self.run(Phase(RunState.RECORDING, tone, self.plan.record_s, segment))
        self._blocks += samples.coefficients
        return self._average(setting.frequency_hz)[0]

    def _average(self, frequency_hz: float) -> tuple[LoopLook, Vector, int]:
        base, m0 = self.fast.motions(self._blocks, frequency_hz)
        seen = _settled_part(np.hstack([base, m0]))
        mean, degrees = seen.mean(axis=0), len(seen) - 1
        squares = 0.5 * np.sum(np.abs(seen - mean) ** 2, axis=0)
        known = max(self._degrees + degrees, 1.0)
        error = np.sqrt((self._squares + squares) / known / len(seen))
        orders = base.shape[1]
        look = LoopLook(mean[:orders], mean[orders:], error[:orders], error[orders:])
        return look, squares, degrees


def _settled_part(seen: Coefficients) -> Coefficients:
    """Return the blocks without their first half; repeat this while the two halves of the rest differ."""
    while len(seen) > 3:
        first, second = seen[: len(seen) // 2], seen[len(seen) // 2 :]
        # Take the scatter from differences of neighbours, because a drift hardly changes these differences.
        scatter = np.sqrt(0.5 * np.mean(np.abs(np.diff(seen, axis=0)) ** 2, axis=0))
        moved = np.abs(first.mean(axis=0) - second.mean(axis=0))
        error = scatter * np.sqrt(1 / len(first) + 1 / len(second))
        fundamentals = [0, seen.shape[1] // 2]
        if np.all((moved <= _DRIFT * error)[fundamentals]):
            break
        seen = second
    return seen


def _is_known(look: LoopLook, level_m: float, plan: BranchContinuation) -> bool:
    """Return whether the standard errors are small enough for the base's present distance from the level."""
    share = look.base_u[: plan.harmonics] / level_m
    wrong = abs(abs(look.base_m[0]) / level_m - 1)
    return bool(
        share[0] <= max(_KNOWN * plan.tolerance, _ROUGHLY * wrong)
        and share[1:].max() <= max(_KNOWN_HARMONIC * plan.tolerance, _ROUGHLY * wrong)
        and look.m0_u[0] <= _KNOWN_RATIO * abs(look.m0_m[0])
    )


_MOST_TRIES = 8
_FIRST_TRIES = 30
"""Number of attempts for the first point, where the model without stops may be inaccurate."""
_NEAR = 0.3
"""Largest relative error of the level at which the unknowns of the first motion are varied one by one."""
_SHORTEST_STEP = 1 / 64
"""Shortest step, as a fraction of the step in the plan."""
_GROWTH, _EASY = 1.5, 3
"""Factor by which steps grow after an easy point; a point is easy up to this number of attempts."""
_PROBE, _PROBE_HARMONIC = -0.05, 0.02
"""Variations of the unknowns: frequency and first coefficient in steps, harmonics relative to the level."""
_BELOW = 5.0
"""Distance of the first coefficient's initial value below the model's value, in steps."""
_ABOVE = 8.0
"""Distance of the initial value above the model's (about threefold) in an approach from above, in steps."""
_LOWERED, _CALM = 0.3, 0.03
"""Largest decrease of the first coefficient per try [steps]; largest base harmonics, relative to the level,
at which it is allowed. Both limits are small, because a motion with impacts is easily lost."""
_SLOPES = 0.05, 1.0
"""Bounds on the slope, the change of the base level per step of the first coefficient, at the start."""
_LEAST_CHANGE = 0.01
"""Smallest change of the first coefficient [steps] from which the slope of the base level is computed."""
_CLOSER, _CLOSE = 0.3, 0.7
"""Fractions of the tolerance used for fundamental and harmonics; small, because folds move with the level."""
_BEND_HZ = 0.05


def follow_branch(loop: SineLoop, plan: BranchContinuation) -> Controller[None]:
    """Ramp up from rest, follow the branch until it ends or leaves its range, and ramp down.

    Raises LimitExceeded before anything is played if, by the model, the loop would not hold the branch.
    """
    fast = fast_loop(loop.rig)
    require_held(fast, plan)
    return _branch(loop, plan, fast)


def _branch(loop: SineLoop, plan: BranchContinuation, fast: FastLoop) -> Controller[None]:
    player = BranchPlayer(loop, plan, fast)
    start_m = level_at(plan, plan.start_hz)
    gains = fast.gains(plan.start_hz, plan.harmonics)
    beside = abs(fast.gains(plan.start_hz + _BEND_HZ, 1)[0])
    first = np.zeros(plan.harmonics, dtype=np.complex128)
    first[0] = start_m / abs(gains[0])
    start = LoopSetting(plan.start_hz, first)
    bend = float(np.log(beside / abs(gains[0]))) / _BEND_HZ
    solver = BranchSolver(start, gains, bend, start_m, plan.step_hz)
    yield from player.run(Phase(RunState.ARMED, None, HUSH_S))
    tone = player.tone(start)
    yield from player.run(ramp(RunState.RAMPING_UP, tone, loop.measurement))
    points, end = yield from _follow(loop, player, solver)
    loop.note(BranchEndNote(points=points, end=end))
    yield from player.run(ramp(RunState.RAMPING_DOWN, tone, loop.measurement))
    yield from loop.say()


def _follow(loop: SineLoop, player: BranchPlayer, solver: BranchSolver) -> Controller[tuple[int, BranchEnd]]:
    plan = player.plan
    way = 1.0 if plan.begin == "up" else -1.0
    points: list[MeasuredPoint] = []
    length, failed = 1.0, 0
    found = yield from _first_motion(player, solver)
    while True:
        if found is None:
            length *= 0.5
            if length < _SHORTEST_STEP or not points:
                return len(points), BranchEnd.LOST
            failed += 1
            yield from _probe(player, solver, points[-1], 2 if failed == 1 else len(points[-1].unknowns))
        else:
            seen, tries = found
            setting = solver.setting(seen.unknowns)
            if points and not plan.low_hz <= setting.frequency_hz <= plan.high_hz:
                return len(points), BranchEnd.RANGE
            yield from _record(loop, player, setting, len(points), tries)
            points.append(seen)
            failed = 0
            if len(points) == plan.most_points:
                return len(points), BranchEnd.POINTS
            if tries <= _EASY:
                length = min(length * _GROWTH, 1.0)
        found = yield from _correct(player, solver, solver.predict(points, length, way))


def _first_motion(player: BranchPlayer, solver: BranchSolver) -> Controller[tuple[MeasuredPoint, int] | None]:
    """Change the drive until the base has the required level; return first motion and number of attempts."""
    predicted = solver.first()
    unknowns = predicted.unknowns.copy()
    above = player.plan.begin_from == "above"
    unknowns[1] += _ABOVE if above else -_BELOW
    slope, before, most = _SLOPES[0], None, _LOWERED if above else 1.0
    for tries in range(1, _FIRST_TRIES + 1):
        seen: MeasuredPoint = yield from _look_at(player, solver, unknowns)
        wrong = float(seen.residual[0])
        if _is_sine(seen.residual, player.plan.tolerance):
            return seen, tries
        if before is not None and abs(moved := seen.unknowns[1] - before.unknowns[1]) > _LEAST_CHANGE:
            slope = min(max((wrong - before.residual[0]) / moved, _SLOPES[0]), _SLOPES[1])
        harmonics = replace(seen, residual=np.concatenate([[0.0], seen.residual[1:]]))
        before, unknowns = seen, solver.correct(harmonics, predicted)
        # Use a secant: nonzero harmonics also change the level, which makes a bracket invalid.
        unknowns[1] = seen.unknowns[1]
        if not above or np.abs(seen.residual[1:]).max() <= _CALM:
            unknowns[1] -= min(max(wrong / slope, -most), most)
    if abs(wrong) > _NEAR:
        return None
    # Level and harmonics interact, so changing all unknowns together would converge slowly.
    yield from _probe(player, solver, seen, len(seen.unknowns))
    return (yield from _correct(player, solver, replace(predicted, unknowns=seen.unknowns)))


def _probe(player: BranchPlayer, solver: BranchSolver, last: MeasuredPoint, columns: int) -> Controller[None]:
    """Return to the last point, and update the derivative by varying the first unknowns one by one.

    The derivatives with respect to frequency and first coefficient change most. Derivatives with respect to
    the harmonics are estimated from joint changes; near a fold, these can make the equations singular.
    """
    here = yield from _look_at(player, solver, last.unknowns)
    for column in range(columns):
        unknowns = last.unknowns.copy()
        unknowns[column] += _PROBE if column < 2 else _PROBE_HARMONIC
        beside = yield from _look_at(player, solver, unknowns)
        solver.probe(column, here, beside)


def _correct(
    player: BranchPlayer, solver: BranchSolver, predicted: PredictedPoint
) -> Controller[tuple[MeasuredPoint, int] | None]:
    """Return the point of the branch near a prediction, and the number of attempts; None if not found."""
    unknowns = predicted.unknowns
    for tries in range(1, _MOST_TRIES + 1):
        seen = yield from _look_at(player, solver, unknowns)
        if _is_sine(seen.residual, player.plan.tolerance) and is_new(seen, predicted):
            return seen, tries
        unknowns = solver.correct(seen, predicted)
    return None


def _look_at(player: BranchPlayer, solver: BranchSolver, unknowns: Vector) -> Controller[MeasuredPoint]:
    plan, setting = player.plan, solver.setting(unknowns)
    level_m = level_at(plan, setting.frequency_hz)
    look = yield from player.measure(setting, level_m)
    residual = residual_of(look.base_m[: plan.harmonics], level_m)
    seen = MeasuredPoint(
        unknowns, residual, look.ratio, noise_of(look.base_u[: plan.harmonics] / level_m, look.ratio_u)
    )
    solver.learn(seen)
    return seen


def _record(
    loop: SineLoop, player: BranchPlayer, setting: LoopSetting, number: int, tries: int
) -> Controller[None]:
    look = yield from player.record(setting, player.plan.segment(number, setting.frequency_hz))
    orders = np.arange(2, len(look.base_m) + 1)
    share = np.abs(look.base_m[1:] / look.base_m[0])
    loop.note(
        BranchPointNote(
            point=number,
            frequency_hz=setting.frequency_hz,
            base_m=float(abs(look.base_m[0])),
            base_u_m=float(look.base_u[0]),
            m0_m=float(abs(look.m0_m[0])),
            m0_u_m=float(look.m0_u[0]),
            phase_deg=degrees(float(np.angle(look.ratio))),
            residue=float(np.linalg.norm(share)),
            residue_acceleration=float(np.linalg.norm(share * orders**2)),
            reference_v=float(abs(setting.reference_v[0])),
            tries=tries,
        )
    )
    if player.plan.perturbation:
        loop.note((yield from perturbed_stability(player, loop.channels, setting, number, look)))


def _is_sine(residual: Vector, tolerance: float) -> bool:
    """Return whether the base moves as a sine of the required level, accurately enough for a branch point."""
    harmonics = np.hypot(residual[1::2], residual[2::2])
    return bool(abs(residual[0]) <= _CLOSER * tolerance and np.all(harmonics <= _CLOSE * tolerance))


_EACH = 5
"""Number of drive periods per change: too few for deviations to grow, enough for upper modes to follow."""
_LEAD, _TRIAL = 3, 8
"""Number of changes before the evaluated changes; number of changes in the trial that finds the size."""
_CHANGED = (0, 2)
"""Indices of the perturbed coefficients: first and third harmonic, at which the specimen drives the table."""
_FIRST_SIZE, _MOST_SIZE = 0.002, 0.05
"""Size of the drive's changes in the trial, and their maximum size, relative to the first coefficient."""
_SAME, _ERRORS = 0.01, 3.0
"""A motion counts as changed if it changes by more than this fraction and this many standard errors."""
_NEVER = 1e-9


def perturbed_stability(
    player: BranchPlayer, channels: FeedbackChannels, setting: LoopSetting, number: int, before: LoopLook
) -> Controller[BranchStabilityNote]:
    """Play small changes of the drive, then repeat them with opposite sign; return the note on stability.

    A trial finds the size of the changes at which base or m0 changes as much as the plan requires.
    """
    plan, frequency_hz = player.plan, setting.frequency_hz
    period = channels.sample_rate_hz / frequency_hz
    count = plan.perturbed_periods // (2 * _EACH)
    # Changes of magnitude 1, with random signs of real and imaginary part, shape (count, coefficients).
    corners = np.random.default_rng(number).integers(0, 4, (count, len(_CHANGED)))
    changes = np.asarray(np.exp(1j * np.pi * (0.25 + 0.5 * corners)))
    first_v = _FIRST_SIZE * abs(setting.reference_v[0])
    phases = yield from _play_changes(player, setting, first_v * changes[:_TRIAL], None)
    seen = max(envelope_deviation(each, period) for each in _join(phases, channels))
    size_v = first_v * min(plan.perturbation / max(seen, _NEVER), _MOST_SIZE / _FIRST_SIZE)
    segment = plan.perturbation_segment(number, frequency_hz, size_v)
    course = np.concatenate([-changes[-_LEAD:], changes, -changes, np.zeros((1, len(_CHANGED)))])
    phases = yield from _play_changes(player, setting, size_v * course, segment)
    after = yield from player.measure(setting, abs(before.base_m[0]))
    return stability_note(_fit(phases, channels, period, count), number, plan.perturbation, before, after)


def _play_changes(
    player: BranchPlayer, setting: LoopSetting, course: Coefficients, segment: Segment | None
) -> Controller[list[PhaseSamples]]:
    """Play changes one after another, connected along half cosines; return the samples of each change."""
    phases = []
    state = RunState.SETTLING if segment is None else RunState.RECORDING
    length_s = _EACH / setting.frequency_hz
    for change in course:
        volts = setting.reference_v.copy()
        volts[list(_CHANGED)] += change
        tone = player.tone(LoopSetting(setting.frequency_hz, volts), length_s)
        phases.append((yield from player.run(Phase(state, tone, length_s, segment))))
    return phases


def _join(phases: list[PhaseSamples], channels: FeedbackChannels) -> tuple[Samples, Samples]:
    rows = [channels.rows(each) for each in phases]
    return np.concatenate([base for _, base, _ in rows]), np.concatenate([m0 for _, _, m0 in rows])


def _fit(
    phases: list[PhaseSamples], channels: FeedbackChannels, period: float, count: int
) -> OpenLoopMultiplier:
    """Return the fitted multiplier; NaN if the run was held, so that samples between phases are missing."""
    if any(one.first_sample + one.volts.shape[1] != two.first_sample for one, two in pairwise(phases)):
        return OpenLoopMultiplier(nan, nan)
    base, m0 = _join(phases, channels)
    return open_loop_multiplier(
        PerturbedMotion(base, m0, period, round(_LEAD * _EACH * period), count * _EACH)
    )


def stability_note(
    found: OpenLoopMultiplier, number: int, perturbation: float, before: LoopLook, after: LoopLook
) -> BranchStabilityNote:
    """Return the note on a fit; undetermined if the held motion changed during the perturbation."""
    error = float(np.hypot(before.m0_u[0], after.m0_u[0]) / abs(before.m0_m[0]))
    moved = float(abs(abs(after.m0_m[0] / before.m0_m[0]) - 1))
    low, high = found.bounds
    stability = Stability.OPEN
    if moved <= max(_SAME, _ERRORS * error):
        # If a bound is NaN, both comparisons are false, and the stability is undetermined.
        stability = Stability.STABLE if high < 1 else Stability.UNSTABLE if low > 1 else Stability.OPEN
    known = isfinite(found.size) and isfinite(found.error)
    return BranchStabilityNote(
        point=number,
        stability=stability,
        multiplier=found.size if known else None,
        multiplier_u=found.error if known else None,
        perturbation=perturbation,
        moved=moved,
    )
