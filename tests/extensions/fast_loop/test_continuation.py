"""Control-based continuation of a curve with folds, and on the virtual rig."""

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.changed import changed
from vibench.acquisition import ConfigurationError, LimitExceeded, open_bench, open_recording, run_measurement
from vibench.acquisition.excitation.plan import BaseLevel
from vibench.acquisition.plan import Measurement, RunState
from vibench.acquisition.recording import (
    BranchEnd,
    BranchEndNote,
    BranchPointNote,
    BranchStabilityNote,
    Stability,
    feedback_note,
)
from vibench.acquisition.rig import ControllerConfig, confirm_simulated, load_rig, specimen_of
from vibench.sim.periodic.balance_branch import balance, balance_branch_within
from vibench.sim.periodic.branch_following import FrequencyPath
from vibench.sim.periodic.harmonic_balance import structure_of
from vibench.sim.periodic.restoring_force import spring_of
from vibench.virtual_rig import VirtualRig
from vibench_fast_loop.branch_continuation import BranchContinuation
from vibench_fast_loop.branch_solver import BranchSolver, LoopSetting, MeasuredPoint, is_new
from vibench_fast_loop.continuation_controller import LoopLook, stability_note
from vibench_fast_loop.fast_loop import fast_loop, impact_branch, require_held
from vibench_fast_loop.open_loop_multiplier import (
    OpenLoopMultiplier,
    PerturbedMotion,
    envelope_deviation,
    open_loop_multiplier,
)
from vibench_fast_loop.protocol import LoopState

LEVEL_M = 3e-6
K1 = 2.1e-3 * (2 * np.pi * 100) ** 2


def hardening(rig, latency_s=3e-4, **virtual):
    """Return the rig with a controller and a cubic spring instead of stops: 0.1 k1 p at 100 µm."""
    specimen = rig.specimen.model_copy(
        update={"contact": "power:3", "gap_m": 99e-6, "hertz_stiffness": 0.1 * K1 * 1e-4 / 1e-9}
    )
    controller = ControllerConfig(rate_hz=10_240, latency_s=latency_s, limit_v=5, source="test")
    changed = {"specimen": specimen, "controller": controller}
    return rig.model_copy(update=changed | {"virtual": rig.virtual.model_copy(update=virtual)})


def continuation(**more):
    usual = {"amplitude_vpp": 4, "start_hz": 94, "low_hz": 90, "high_hz": 118, "record_s": 0.3}
    given = usual | more
    return BranchContinuation(base_level=BaseLevel(displacement_m=LEVEL_M), **given)


def measurement(plan):
    return Measurement(name="branch", excitation=plan, ramp_s=0.4)


def follow_branch(rig, plan, path, true=None):
    """Follow a branch on a rig; ``true`` is the real rig if the configuration is wrong."""
    with ExitStack() as stack:
        if true is not None:
            virtual = stack.enter_context(VirtualRig(true))
            rig = changed(
                rig,
                virtual=None,
                daq={"server": virtual.daq_address},
                controller={"resource": virtual.controller_resource},
            )
        bench = stack.enter_context(open_bench(rig, confirm=confirm_simulated))
        outcome = run_measurement(bench, measurement(plan), path)
    assert outcome.state is RunState.FINISHED
    with open_recording(outcome.path) as recording:
        notes = [feedback_note(event) for event in recording.events]
    return [each for each in notes if isinstance(each, BranchPointNote)], [each for each in notes if each]


def hardening_resonator(setting):
    """Return base level and m0 over base of a damped resonator: B = P (0.12 |P|^2 - d + 0.4 i)."""
    detuning = setting.frequency_hz - 100.0
    size = np.linspace(1e-3, 9, 200_001)
    stiff = 0.12 * size**2 - detuning
    # The feedback law adds damping, and so removes the folds.
    told = size * np.hypot(stiff, 2.4)
    at = int(np.searchsorted(told, abs(setting.reference_v[0])))
    base = size[at] * complex(stiff[at], 0.4)
    return abs(base), size[at] / base


def test_the_solver_follows_a_curve_through_both_folds():
    level = 2.0
    start = LoopSetting(98.0, np.array([level + 0j]))
    solver = BranchSolver(start, np.array([1.0 + 0j]), 0.0, level, step_hz=0.25)

    def measured_at(unknowns):
        found, ratio = hardening_resonator(solver.setting(unknowns))
        one = MeasuredPoint(unknowns, np.array([found / level - 1]), ratio, np.zeros(3))
        solver.learn(one)
        return one

    def correct_point(foreseen):
        one = measured_at(foreseen.unknowns)
        for _ in range(12):
            if abs(one.residual[0]) < 2e-3 and is_new(one, foreseen):
                return one
            one = measured_at(solver.correct(one, foreseen))
        return None

    points, length = [correct_point(solver.first())], 1.0
    while len(points) < 80 and length > 1e-2:
        one = correct_point(solver.predict(tuple(points[-2:]), length, 1.0))
        if one is None:
            length /= 2
            here = measured_at(points[-1].unknowns)
            for column in (0, 1):
                beside = points[-1].unknowns.copy()
                beside[column] -= 0.05
                solver.probe(column, here, measured_at(beside))
        else:
            points.append(one)
            length = min(1.5 * length, 1.0)
    hertz = 0.25 * np.array([each.unknowns[0] for each in points])
    assert all(abs(each.residual[0]) < 2e-3 for each in points)
    # The fold is at |P| = 2 / 0.4, at a detuning of 0.12 |P|^2 = 3 Hz; frequencies up and down.
    turns = np.flatnonzero(np.diff(np.sign(np.diff(hertz)))) + 1
    assert len(turns) == 2
    assert hertz[turns[0]] == pytest.approx(103.0, abs=0.1)
    assert turns[1] > turns[0] + 6
    assert hertz[-1] > hertz[turns[0]] > hertz[turns[1]]


def test_the_direction_of_the_next_step_ignores_points_closer_than_their_noise():
    """Two points of a noisy arc are close together, as after a halved step at a fold."""
    rng = np.random.default_rng(22)
    solver = BranchSolver(LoopSetting(98.0, np.array([1.0 + 0j])), np.array([1.0 + 0j]), 0.0, 1.0, 0.25)
    for _ in range(100):
        radius, close, noise = rng.uniform(3, 10), rng.uniform(0.005, 0.05), rng.uniform(2e-3, 0.02)
        turns = rng.uniform(0, 2 * np.pi) + np.array([-2.0, -1.5, -1.0, -0.5, 0.0, close]) / radius
        points = [
            MeasuredPoint(
                np.array([radius * np.cos(turn), 0.1 * turn]),
                np.zeros(1),
                complex(radius * np.sin(turn), 0.5 * turn) + noise * complex(*rng.standard_normal(2)),
                np.array([1e-4, noise, noise]),
            )
            for turn in turns
        ]
        tangent = np.array([-radius * np.sin(turns[-1]), radius * np.cos(turns[-1]), 0.5])
        along = solver.predict(points, 0.1, 1.0).along
        assert along @ tangent / np.linalg.norm(tangent) > 0.95


def model_of(rig):
    """Return the computed branch of the rig's specimen, and its folds."""
    structure, spring = structure_of(specimen_of(rig)), spring_of(specimen_of(rig))
    start = balance(structure, spring, 90.0, LEVEL_M)
    branch = balance_branch_within(structure, spring, start, FrequencyPath((LEVEL_M,)), 89.0, 120.0)
    return branch, [each for each in branch.events if each.kind.value == "fold"]


@pytest.mark.thorough
def test_a_branch_starts_at_the_set_level_and_small_perturbations_show_its_stability(rig, tmp_path):
    hard = hardening(rig)
    path = tmp_path / "perturbed.h5"
    points, notes = follow_branch(hard, continuation(start_hz=94, most_points=2, perturbation=0.02), path)
    told = [each for each in notes if isinstance(each, BranchStabilityNote)]
    branch, _ = model_of(hard)
    assert [each.point for each in points] == [each.point for each in told] == [0, 1]
    assert notes[-1] == BranchEndNote(points=2, end=BranchEnd.POINTS)
    for each in points:
        assert each.base_m == pytest.approx(LEVEL_M, rel=0.004)
        assert each.residue < 0.005
        m0 = LEVEL_M * np.interp(each.frequency_hz, branch.frequencies_hz[:60], branch.response_ii[:60, 0])
        assert each.m0_m == pytest.approx(m0, rel=0.01)
    size = np.interp(94.0, branch.frequencies_hz[:60], np.abs(branch.multipliers[:60, 0]))
    assert told[0].stability is Stability.STABLE
    assert told[0].multiplier == pytest.approx(size, abs=2.1 * told[0].multiplier_u)
    assert told[0].multiplier_u < 0.015
    assert told[0].moved < 2e-3
    with open_recording(path) as recording:
        changed = next(each for each in recording.segments if each.label == "perturbed")
        lasted_s = (changed.stop - changed.first_sample) / recording.sample_rate_hz
        base = recording.read("base_acceleration", changed.first_sample, changed.stop)
        m0 = recording.read("m0_velocity", changed.first_sample, changed.stop)
    assert lasted_s == pytest.approx(220 / 94, abs=0.01), "time-bounded"
    period = recording.sample_rate_hz / points[0].frequency_hz
    again = open_loop_multiplier(PerturbedMotion(base, m0, period, round(15 * period), 100))
    assert again.size == pytest.approx(told[0].multiplier, abs=1e-4), "the recording tells it once more"
    assert max(envelope_deviation(each, period) for each in (base, m0)) == pytest.approx(0.02, rel=0.6)


def test_a_motion_that_changed_during_the_test_gets_no_stability_verdict():
    look = LoopLook(np.array([3e-6 + 0j]), np.array([9e-6 + 0j]), np.array([1e-9]), np.array([1e-9]))
    moved = replace(look, m0_m=1.02 * look.m0_m)
    surely = OpenLoopMultiplier(1.2, 0.01)
    assert stability_note(surely, 3, 0.02, look, look).stability is Stability.UNSTABLE
    assert stability_note(surely, 3, 0.02, look, moved).stability is Stability.OPEN
    nothing = stability_note(OpenLoopMultiplier(float("nan"), float("nan")), 3, 0.02, look, look)
    assert nothing.stability is Stability.OPEN
    assert nothing.multiplier is None


def test_a_bench_without_a_controller_is_refused_with_advice(rig, tmp_path):
    with open_bench(rig) as bench, pytest.raises(ConfigurationError, match=r"add \[controller\]"):
        run_measurement(bench, measurement(continuation()), tmp_path / "none.h5")


@pytest.mark.thorough
@pytest.mark.timeout(400)
def test_a_latency_that_makes_the_loop_unstable_is_refused_before_output(rig, tmp_path):
    with open_bench(hardening(rig, latency_s=1.5e-3)) as bench:
        with pytest.raises(LimitExceeded, match=r"largest multiplier is 1\.\d+ at .* with 1.5 ms of latency"):
            run_measurement(bench, measurement(continuation()), tmp_path / "late.h5")
        assert bench.controller.report().state is LoopState.SILENT
    assert not (tmp_path / "late.h5").exists()


def rig_and_plan_with_stops(**more):
    """Return a rig with controller and the paper's specimen, and a plan from above at 1 µm."""
    stops = load_rig(Path("virtual_rig_controller"))
    stops = stops.model_copy(update={"specimen": load_rig(Path("virtual_rig")).specimen})
    usual = {"start_hz": 97.5, "low_hz": 96.85, "high_hz": 100, "begin_from": "above", "step_hz": 0.25}
    plan = continuation(**(usual | {"harmonics": 7} | more))
    return stops, plan.model_copy(update={"base_level": BaseLevel(displacement_m=1e-6)})


@pytest.mark.thorough
@pytest.mark.timeout(400)
def test_motions_near_grazing_are_refused_with_the_loop_multiplier(rig):
    fast = fast_loop(hardening(rig).model_copy(update={"specimen": rig.specimen}))
    plan = continuation(start_hz=254, low_hz=253.9, high_hz=254.3)
    with pytest.raises(LimitExceeded, match=r"multiplier is 1\d\d at .* from 254 to 254\.2\d? Hz\."):
        require_held(fast, plan)


def test_a_branch_is_refused_if_the_model_has_no_periodic_motion_or_no_finite_force():
    stops, plan = rig_and_plan_with_stops(start_hz=95, low_hz=94, high_hz=96, begin_from="rest")
    with pytest.raises(LimitExceeded, match="finds no motion that repeats every period at start_hz = 95"):
        require_held(fast_loop(stops), plan)
    rigid = stops.specimen.model_copy(update={"contact": "rigid:0.8"})
    with pytest.raises(LimitExceeded, match="rigid stops have no finite contact force"):
        require_held(fast_loop(stops.model_copy(update={"specimen": rigid})), plan)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("rate_hz", [10_240.0, 5120.0])
def test_unstable_motions_with_impacts_are_held_beyond_their_fold(tmp_path, rate_hz):
    """The paper's specimen, from above: at least 10 unstable motions, up to a multiplier of 2."""
    stops, plan = rig_and_plan_with_stops()
    stops = changed(stops, daq={"sample_rate_hz": rate_hz})
    points, notes = follow_branch(stops, plan, tmp_path / "stops.h5")
    # Where the model's multiplier is 2 or more, noise decides how far the branch is held.
    assert notes[-1].end in (BranchEnd.RANGE, BranchEnd.LOST), notes
    branch = impact_branch(specimen_of(stops), 1e-6, 97.5, (96.4, 100.0), "above")
    fold = next(each for each in branch.events if each.kind.value == "fold")
    hertz = np.array([each.frequency_hz for each in points])
    turn = int(np.argmax(hertz))
    assert hertz[turn] == pytest.approx(fold.frequency_hz, abs=0.1)
    behind = points[turn + 1 :]
    f, sizes = branch.frequencies_hz[fold.index + 1 :][::-1], np.abs(branch.multipliers[fold.index + 1 :, 0])
    held = np.interp([each.frequency_hz for each in behind], f, sizes[::-1])
    assert np.count_nonzero(held > 1) >= 10
    assert held.max() > 1.9
    assert all(each.base_m == pytest.approx(1e-6, rel=0.005) for each in behind)


NOISES = ("generator_noise_v", "amplifier_noise_v", "accelerometer_noise_m_per_s2")
NOISES += ("vibrometer_noise_m_per_s_per_rthz", "converter_noise_v")


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("noise", [1.0, 10.0])
def test_a_feedback_law_from_a_wrong_model_holds_a_branch_through_both_folds(rig, tmp_path, noise):
    """Takes minutes: at least 15 unstable points, folds within 0.3 Hz, m0 within 2 %."""
    true = hardening(rig, **{each: noise * getattr(rig.virtual, each) for each in NOISES})
    # The configuration has springs that are 10 % too stiff, and a coil force that is 10 % too large.
    stiffer = tuple(1.1**0.5 * each for each in true.specimen.single_frequencies_hz)
    believed = changed(
        true, shaker={"force_constant_n_per_a": 1.1 * 6.78}, specimen={"single_frequencies_hz": stiffer}
    )
    plan = continuation(most_points=110, perturbation=0.02)
    points, notes = follow_branch(believed, plan, tmp_path / "branch.h5", true)
    branch, folds = model_of(true)
    hertz = np.array([each.frequency_hz for each in points])
    assert isinstance(notes[-1], BranchEndNote)
    assert notes[-1].end is BranchEnd.RANGE, notes
    top, bottom = np.flatnonzero(np.diff(np.sign(np.diff(hertz)))) + 1
    assert hertz[top] == pytest.approx(folds[0].frequency_hz, abs=0.3)
    assert hertz[bottom] == pytest.approx(folds[1].frequency_hz, abs=0.3)
    assert bottom - top - 1 >= 15
    unstable = slice(folds[0].index + 1, folds[1].index + 1)
    f, ratio = branch.frequencies_hz[unstable][::-1], branch.response_ii[unstable, 0][::-1]
    for each in points[top + 1 : bottom]:
        assert each.base_m == pytest.approx(LEVEL_M, rel=0.005)
        assert 0 < each.base_u_m < 0.002 * LEVEL_M
        assert each.residue < 0.005
        if f[0] + 0.2 < each.frequency_hz < f[-1] - 0.2:
            assert each.m0_m == pytest.approx(LEVEL_M * np.interp(each.frequency_hz, f, ratio), rel=0.02)
    told = {each.point: each.stability for each in notes if isinstance(each, BranchStabilityNote)}
    behind = [told[each] for each in range(top + 2, bottom - 1)]
    assert Stability.STABLE not in behind
    beside = (*range(top - 1), *range(bottom + 2, len(points)))
    assert Stability.UNSTABLE not in [told[each] for each in beside]
    if noise == 1.0:
        assert behind.count(Stability.UNSTABLE) >= 0.8 * len(behind)
