"""Compare branches held by the real-time controller of the virtual rig with those of the model.

    python benchmarks/held_branches.py [--noise 10] [--wrong 1.1] [--latency 5e-4] [--seed 1] [--out DIR]
    python benchmarks/held_branches.py --stability 0.02 [--noise 3]
    python benchmarks/held_branches.py --stops
    python benchmarks/held_branches.py --latencies 0.3,1,1.2,1.5,2 --draw docs/images/held_latency.png

The script follows the branch of campaigns/branch.toml on the virtual rig with a controller, and prints how
far the measured points lie from the model's branch. All noise of the virtual rig is multiplied by
``--noise``. With ``--wrong``, the host's model has stiffer springs and a stronger coil than the true rig, by
this factor. With ``--stability``, small changes of this size determine the stability of each point, beside
the model's Floquet multipliers. With ``--stops``, the specimen is the paper's, and the branch has impacts and
is followed downwards. With ``--latencies`` [ms], each branch is started even if the loop cannot hold it (the
check is disabled here). The frequency at which it was lost is printed beside that at which the model's
largest multiplier exceeds one.
"""

import argparse
import tempfile
import time
from collections import Counter
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from vibench.acquisition import (
    AcquisitionError,
    load_campaign,
    open_bench,
    open_recording,
    run_measurement,
)
from vibench.acquisition.excitation.plan import BaseLevel
from vibench.acquisition.recording import (
    BranchEndNote,
    BranchPointNote,
    BranchStabilityNote,
    FeedbackNote,
    feedback_note,
)
from vibench.acquisition.rig import (
    Rig,
    amplifier_of,
    confirm_simulated,
    load_rig,
    shaker_of,
    specimen_of,
)
from vibench.analysis.report import MEASURED, SIMULATED, figure_style, legend_above, new_figure
from vibench.sim import Specimen
from vibench.sim.periodic.balance_branch import balance, balance_branch_within
from vibench.sim.periodic.branch import Branch
from vibench.sim.periodic.branch_following import FrequencyPath
from vibench.sim.periodic.harmonic_balance import structure_of
from vibench.sim.periodic.restoring_force import spring_of
from vibench.virtual_rig import VirtualRig
from vibench_fast_loop import continuation_controller as _continuation_controller
from vibench_fast_loop.branch_continuation import BranchContinuation
from vibench_fast_loop.fast_loop import branch_multipliers, impact_branch
from vibench_fast_loop.law import LoopTiming, SampledPlant, design_law

NOISES = (
    "generator_noise_v",
    "amplifier_noise_v",
    "accelerometer_noise_m_per_s2",
    "vibrometer_noise_m_per_s_per_rthz",
    "converter_noise_v",
)
BESIDE_HZ = 0.2
"""Distance from a fold within which m0 is not compared, because the branch is steep there [Hz]."""
FINE = 25
"""Number of latencies of the model's curve."""


def change_rig(rig: Rig, noise: float, seed: int, latency_s: float | None) -> Rig:
    """Return the rig with changed noise, seed and latency."""
    virtual = rig.virtual
    louder = {name: noise * getattr(virtual, name) for name in NOISES}
    told = {"virtual": virtual.model_copy(update=louder | {"seed": seed})}
    if latency_s is not None:
        told["controller"] = rig.controller.model_copy(update={"latency_s": latency_s})
    return rig.model_copy(update=told)


def wrong_rig(rig: Rig, wrong: float, virtual: VirtualRig) -> Rig:
    """Return a wrong description of the rig, with the addresses of the true instruments."""
    stiffer = tuple(wrong**0.5 * each for each in rig.specimen.single_frequencies_hz)
    push = wrong * rig.shaker.force_constant_n_per_a
    return rig.model_copy(
        update={
            "virtual": None,
            "daq": rig.daq.model_copy(update={"server": virtual.daq_address}),
            "controller": rig.controller.model_copy(update={"resource": virtual.controller_resource}),
            "shaker": rig.shaker.model_copy(update={"force_constant_n_per_a": push}),
            "specimen": rig.specimen.model_copy(update={"single_frequencies_hz": stiffer}),
        }
    )


def model_of(rig: Rig, plan: BranchContinuation) -> Branch:
    """Return the branch of the true specimen."""
    structure, spring = structure_of(specimen_of(rig)), spring_of(specimen_of(rig))
    level_m = plan.base_level.displacement_m
    start = balance(structure, spring, plan.low_hz, level_m)
    return balance_branch_within(
        structure, spring, start, FrequencyPath((level_m,)), plan.low_hz - 1, plan.high_hz + 2
    )


def compare(points: list[BranchPointNote], branch: Branch, level_m: float) -> None:
    """Print how far measured points lie from the model's branch."""
    hertz = np.array([each.frequency_hz for each in points])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(hertz)))) + 1
    folds = [each for each in branch.events if each.kind.value == "fold"]
    print(f"points {len(points)}, looks {sum(each.tries for each in points)}")
    model_hz = np.array([each.frequency_hz for each in folds])
    print(f"folds held [Hz] {hertz[turns].round(3)}, model {model_hz.round(3)}")
    base = max(abs(each.base_m / level_m - 1) for each in points)
    print(f"base over its level: within {base:.2%}")
    print(
        f"harmonics of the base: displacement {max(each.residue for each in points):.2%}, "
        f"acceleration {max(each.residue_acceleration for each in points):.1%}"
    )
    if len(turns) != 2 or len(folds) != 2:
        return
    first, last = folds[0].index + 1, folds[1].index + 1
    legs = [
        (slice(0, turns[0]), slice(0, first)),
        (slice(turns[0] + 1, turns[1]), slice(first, last)),
        (slice(turns[1] + 1, None), slice(last, None)),
    ]
    for name, (held, model) in zip(("below", "unstable", "above"), legs, strict=True):
        f, ratio = branch.frequencies_hz[model], branch.response_ii[model, 0]
        order = np.argsort(f)
        away = [
            abs(each.m0_m / (level_m * np.interp(each.frequency_hz, f[order], ratio[order])) - 1)
            for each in points[held]
            if f.min() + BESIDE_HZ < each.frequency_hz < f.max() - BESIDE_HZ
        ]
        print(f"{name}: {len(points[held])} points, m0 within {max(away, default=0.0):.2%}")


def compare_stability(notes: list[FeedbackNote | None], branch: Branch, level_m: float) -> None:
    """Print the measured stability of each point, beside the model's largest multiplier."""
    points = [each for each in notes if isinstance(each, BranchPointNote)]
    hertz = np.array([each.frequency_hz for each in points])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(hertz)))) + 1
    folds = [each.index for each in branch.events if each.kind.value == "fold"]
    legs = [slice(0, folds[0] + 1), slice(folds[0] + 1, folds[1] + 1), slice(folds[1] + 1, None)]
    model, counts = np.abs(branch.multipliers[:, 0]), Counter[str]()
    inside = away = 0.0
    told = [each for each in notes if isinstance(each, BranchStabilityNote) and each.multiplier is not None]
    for each in told:
        point = points[each.point]
        leg = legs[int(np.searchsorted(turns[:2], each.point))]
        far_hz = np.hypot(
            branch.frequencies_hz[leg] - point.frequency_hz,
            20 * np.log(branch.response_ii[leg, 0] * level_m / point.m0_m),
        )
        true = float(model[leg][np.argmin(far_hz)])
        wrong = each.multiplier - true
        inside += abs(wrong) < 2.1 * each.multiplier_u
        away = max(away, each.moved)
        counts[f"{'unstable' if true > 1 else 'stable'} by the model, told {each.stability.value}"] += 1
        print(
            f"{point.frequency_hz:8.3f} Hz: {each.multiplier:.4f} +- {each.multiplier_u:.4f}, model "
            f"{true:.4f}, {each.stability.value}"
        )
    print(f"{len(told)} points, in bounds of 95 %: {inside / max(len(told), 1):.0%}; m0 moved by {away:.2%}")
    print("; ".join(f"{name}: {count}" for name, count in sorted(counts.items())))


STOPS = BranchContinuation(
    amplitude_vpp=4.0, base_level=BaseLevel(displacement_m=1e-6), start_hz=97.5, low_hz=96.9, high_hz=100.0,
    begin_from="above", step_hz=0.25, harmonics=7, record_s=0.3,
)  # fmt: skip


def compare_stops(points: list[BranchPointNote], specimen: Specimen) -> None:
    """Print how far measured motions with impacts lie from the model's, and the model's multipliers."""
    level_m = STOPS.base_level.displacement_m
    range_hz = STOPS.low_hz - 0.4, STOPS.high_hz
    branch = impact_branch(specimen, level_m, STOPS.start_hz, range_hz, "above")
    fold = next(each for each in branch.events if each.kind.value == "fold")
    hertz = np.array([each.frequency_hz for each in points])
    turn = int(np.argmax(hertz))
    print(
        f"points {len(points)}, looks {sum(each.tries for each in points)}; "
        f"behind the fold {len(points) - turn - 1}"
    )
    print(f"fold held {hertz[turn]:.3f} Hz, model {fold.frequency_hz:.3f} Hz")
    print(f"base over its level: within {max(abs(each.base_m / level_m - 1) for each in points):.2%}")
    print(
        f"harmonics of the base: displacement {max(each.residue for each in points):.2%}, "
        f"acceleration {max(each.residue_acceleration for each in points):.1%}"
    )
    behind = slice(fold.index + 1, None)
    f, sizes = branch.frequencies_hz[behind][::-1], np.abs(branch.multipliers[behind, 0])[::-1]
    ratio = branch.response_ii[behind, 0][::-1]
    rows = [
        (
            each.m0_m / level_m / np.interp(each.frequency_hz, f, ratio) - 1,
            np.interp(each.frequency_hz, f, sizes),
        )
        for each in points[turn + 1 :]
    ]
    print(
        f"unstable: m0 within {max(abs(away) for away, _ in rows):.1%}, multipliers by the model "
        f"{min(size for _, size in rows):.3g} to {max(size for _, size in rows):.3g}"
    )


def find_loss(rig: Rig, latency_s: float, folder: Path) -> tuple[float, str]:
    """Follow the branch at a latency; return the highest frequency held, and the reason for the end."""
    measurement = load_campaign("branch").measurements[0]
    plan = measurement.excitation.model_copy(update={"step_hz": 2.0, "most_points": 24, "perturbation": 0.0})
    controller = rig.controller.model_copy(update={"latency_s": latency_s})
    with open_bench(rig.model_copy(update={"controller": controller}), confirm=confirm_simulated) as bench:
        path = folder / f"late_{1e6 * latency_s:.0f}us.h5"
        try:
            run_measurement(bench, measurement.model_copy(update={"excitation": plan}), path)
        except AcquisitionError as error:
            ended = f"{error}".partition(". ")[0]
        else:
            ended = ""
    with open_recording(next(folder.glob(f"{path.stem}*"))) as recording:
        notes = [feedback_note(event) for event in recording.events]
    hertz = [each.frequency_hz for each in notes if isinstance(each, BranchPointNote)]
    ends = [each.end.value for each in notes if isinstance(each, BranchEndNote)]
    return max(hertz, default=plan.start_hz), ended or ends[0]


def late(latencies_ms: list[float], draw: Path | None, folder: Path) -> None:
    """Print and draw where branches are lost, in the measurement and in the model."""
    rig = load_rig(Path("virtual_rig_controller"))
    branch = model_of(rig, load_campaign("branch").measurements[0].excitation)
    fold = next(each.index for each in branch.events if each.kind.value == "fold")
    leg = np.arange(0, fold + 1, max(1, fold // 40))
    # Disable the check that refuses these plans, because this script measures when they fail.
    _continuation_controller.require_held = lambda *_: None
    rows = []
    for each in sorted(latencies_ms):
        held_hz, ended = find_loss(rig, 1e-3 * each, folder)
        model_hz, largest = model_loss(rig, branch, leg, each)
        rows.append((each, held_hz))
        print(
            f"{each:g} ms: held to {held_hz:.5g} Hz ({ended}); by the model to {model_hz:.5g} Hz, "
            f"largest multiplier {largest:.3g}",
            flush=True,
        )
    if draw is not None:
        fine = np.linspace(min(latencies_ms), max(latencies_ms), FINE)
        model = np.array([(each, *model_loss(rig, branch, leg, each)) for each in fine])
        picture(np.array(rows), model, float(branch.frequencies_hz[leg].max()), draw)


def model_loss(rig: Rig, branch: Branch, leg: np.ndarray, latency_ms: float) -> tuple[float, float]:
    """Return where the loop's largest multiplier passes 1, or else the fold; and the largest one."""
    table = amplifier_of(rig), shaker_of(rig), specimen_of(rig)
    plant = SampledPlant(*table, LoopTiming(rig.controller.rate_hz, 1e-3 * latency_ms))
    multipliers, hertz = (
        branch_multipliers(plant, design_law(plant), branch, leg),
        branch.frequencies_hz[leg],
    )
    beyond = np.flatnonzero(multipliers > 1)
    if not beyond.size:
        return float(hertz.max()), float(multipliers.max())
    about = slice(max(int(beyond[0]) - 1, 0), int(beyond[0]) + 1)
    lost_hz = np.interp(1.0, multipliers[about], hertz[about])
    return float(lost_hz), float(multipliers.max())


def picture(rows: np.ndarray, model: np.ndarray, fold_hz: float, path: Path) -> None:
    """Draw over latency: frequency of the loss, measured and modelled, and the model's largest multiplier."""
    with figure_style():
        figure = new_figure(3.2)
        left, right = figure.subplots(1, 2)
        left.axhline(fold_hz, color="0.6", linewidth=0.8, label="fold of the branch")
        left.plot(
            *model[:, :2].T, color=SIMULATED, linestyle="--", label="model: multiplier of the loop is 1"
        )
        left.plot(*rows.T, color=MEASURED, marker="o", markersize=4, linestyle="none", label="held up to")
        left.set_ylabel("drive frequency [Hz]")
        right.axhline(1.0, color="0.6", linewidth=0.8)
        right.plot(model[:, 0], model[:, 2], color=SIMULATED, linestyle="--")
        right.set_ylabel("largest multiplier of the loop")
        for axes in (left, right):
            axes.set_xlabel("latency [ms]")
        legend_above(figure, [left], columns=3)
        figure.savefig(path, dpi=150)


def main() -> None:
    """Follow the branch, compare it with the model, and print the differences."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--noise", type=float, default=1.0)
    parser.add_argument("--wrong", type=float, default=1.0)
    parser.add_argument("--latency", type=float)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--stability", type=float, default=0.0)
    parser.add_argument("--stops", action="store_true")
    parser.add_argument("--latencies", type=lambda text: [float(each) for each in text.split(",")])
    parser.add_argument("--draw", type=Path)
    given = parser.parse_args()
    if given.latencies:
        with tempfile.TemporaryDirectory() as temporary:
            late(given.latencies, given.draw, Path(temporary))
        return
    true = change_rig(load_rig(Path("virtual_rig_controller")), given.noise, given.seed, given.latency)
    measurement = load_campaign("branch").measurements[0]
    if given.stops:
        true = true.model_copy(update={"specimen": load_rig(Path("virtual_rig")).specimen})
        measurement = measurement.model_copy(update={"excitation": STOPS})
    plan = measurement.excitation.model_copy(update={"perturbation": given.stability})
    measurement = measurement.model_copy(update={"excitation": plan})
    with ExitStack() as stack:
        folder = given.out or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        folder.mkdir(parents=True, exist_ok=True)
        rig = true
        if given.wrong != 1.0:
            rig = wrong_rig(true, given.wrong, stack.enter_context(VirtualRig(true)))
        bench = stack.enter_context(open_bench(rig, confirm=confirm_simulated))
        begin_s = time.process_time()
        outcome = run_measurement(bench, measurement, folder / "branch.h5")
        with open_recording(outcome.path) as recording:
            notes = [feedback_note(event) for event in recording.events]
            rig_s = recording.duration_s
    print(
        f"noise x{given.noise:g}, model x{given.wrong:g}: {outcome.state.value}, {rig_s:.0f} s of rig time, "
        f"{time.process_time() - begin_s:.0f} s of processor time"
    )
    print("; ".join(each.end.value for each in notes if isinstance(each, BranchEndNote)))
    points = [each for each in notes if isinstance(each, BranchPointNote)]
    if given.stops:
        compare_stops(points, specimen_of(true))
        return
    branch = model_of(true, plan)
    compare(points, branch, plan.base_level.displacement_m)
    if given.stability:
        compare_stability(notes, branch, plan.base_level.displacement_m)


if __name__ == "__main__":
    main()
