"""Branches of the virtual rig held by its real-time controller, beside those of the model.

    python benchmarks/held_branches.py [--noise 10] [--wrong 1.1] [--latency 5e-4] [--seed 1] [--out DIR]

Follows the branch of campaigns/branch.toml on the virtual rig with a controller, every noise of its
virtual section times ``--noise``, and prints how far what was measured lies from the model's branch. With
``--wrong`` the host believes in springs stiffer and a coil stronger by that factor than those that move.
"""

import argparse
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from vibench.acquisition import load_campaign, open_bench, open_recording, run_measurement
from vibench.acquisition.plan import BranchContinuation
from vibench.acquisition.recording import BranchEndNote, BranchPointNote, feedback_note
from vibench.acquisition.rig import Rig, confirm_simulated, load_rig, specimen_of
from vibench.sim.periodic import (
    Branch,
    FrequencyPath,
    balance,
    balance_branch_within,
    spring_of,
    structure_of,
)
from vibench.virtual_rig import VirtualRig

NOISES = (
    "generator_noise_v",
    "amplifier_noise_v",
    "accelerometer_noise_m_per_s2",
    "vibrometer_noise_m_per_s_per_rthz",
    "converter_noise_v",
)
BESIDE_HZ = 0.2
"""So near to a fold m0 is not compared: the branch is steep there."""


def changed(rig: Rig, noise: float, seed: int, latency_s: float | None) -> Rig:
    """Give a rig with other noise and latency."""
    virtual = rig.virtual
    louder = {name: noise * getattr(virtual, name) for name in NOISES}
    told = {"virtual": virtual.model_copy(update=louder | {"seed": seed})}
    if latency_s is not None:
        told["controller"] = rig.controller.model_copy(update={"latency_s": latency_s})
    return rig.model_copy(update=told)


def believed(rig: Rig, wrong: float, virtual: VirtualRig) -> Rig:
    """Give what a host believes whose model is wrong, and where it finds the instruments of the true rig."""
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
    """Follow the branch of the specimen that is really there."""
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


def main() -> None:
    """Follow, compare, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--noise", type=float, default=1.0)
    parser.add_argument("--wrong", type=float, default=1.0)
    parser.add_argument("--latency", type=float)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    true = changed(load_rig(Path("virtual_rig_controller")), given.noise, given.seed, given.latency)
    measurement = load_campaign("branch").measurements[0]
    plan = measurement.excitation
    with ExitStack() as stack:
        folder = given.out or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        folder.mkdir(parents=True, exist_ok=True)
        rig = true
        if given.wrong != 1.0:
            rig = believed(true, given.wrong, stack.enter_context(VirtualRig(true)))
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
    compare(points, model_of(true, plan), plan.base_level.displacement_m)


if __name__ == "__main__":
    main()
