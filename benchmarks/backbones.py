"""Backbones of three modes over three decades of level on the virtual rig, beside the simulated ones.

    python benchmarks/backbones.py [--mode 1] [--spring hardening] [--levels 49] [--periods 150] [--seed 1]

Tracks the phase resonance of each mode of the paper's specimen with a fixture of 0.6 kg, and prints, level by
level, frequency with its standard uncertainty and the drive periods it took, beside the motions that the
model has there (`phase_resonance_branch`): frequency, and largest Floquet multiplier in brackets. Where no
resonance was met, where the loop was, and whether that motion repeats. With
``--spring hardening`` p^3 stands in the place of the stops (0.1 k1 p at 100 um). The weaker levels are
played with the amplifier 30 dB lower: the generator's setting has steps of a millivolt.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.excitation import Settling
from vibench.acquisition.plan import Measurement, ResonanceTracking
from vibench.acquisition.recording import ResonanceNote, feedback_note
from vibench.acquisition.rig import Rig, confirm_simulated, load_rig, specimen_of
from vibench.sim import Branch, PhaseReference, Specimen, phase_resonance_branch

GAINS_DB = -20.0, 10.0
K1 = 2.1e-3 * (2 * np.pi * 100) ** 2


@dataclass(frozen=True)
class Tracked:
    """Which mode is tracked, where, and over which levels of the base."""

    start_hz: float
    low_hz: float
    high_hz: float
    widest_step_hz: float
    of: PhaseReference
    lowest: float
    """The weakest level, three decades below the strongest [m/s2]."""
    turned_up: float
    """From here on the amplifier is turned up; the motion has no contacts yet [m/s2]."""
    band_hz: tuple[float, float]
    """Where the model's linear motion meets the phase once."""


MODES = {
    1: Tracked(94.5, 90, 170, 0.8, PhaseReference.RELATIVE, 0.02, 0.1, (92, 97)),
    2: Tracked(264, 250, 330, 3, PhaseReference.RELATIVE, 0.04, 1.0, (255, 275)),
    3: Tracked(496, 470, 530, 5, PhaseReference.ABSOLUTE, 0.05, 1.5, (490, 510)),
}


def rig_of(spring: str, seed: int) -> Rig:
    """Give the virtual rig with a fixture, and stops or a smooth spring."""
    rig = load_rig(Path("virtual_rig"))
    changed = {
        "shaker": rig.shaker.model_copy(update={"fixture_mass_kg": 0.6}),
        "daq": rig.daq.model_copy(update={"sample_rate_hz": 10_240.0}),
        "virtual": rig.virtual.model_copy(update={"seed": seed}),
    }
    if spring == "hardening":
        cubic = {"contact": "power:3", "gap_m": 99e-6, "hertz_stiffness": 0.1 * K1 * 1e-4 / 1e-9}
        changed["specimen"] = rig.specimen.model_copy(update=cubic)
    return rig.model_copy(update=changed)


def tracked(
    rig: Rig, mode: Tracked, levels: np.ndarray, most_periods: int, folder: Path
) -> list[ResonanceNote]:
    """Track the mode over all levels; the amplifier is turned up between them."""
    notes = []
    halves = np.split(levels, [np.searchsorted(levels, mode.turned_up)])
    for gain_db, part in zip(GAINS_DB, halves, strict=True):
        plan = ResonanceTracking(
            amplitude_vpp=9.0,
            start_hz=mode.start_hz,
            low_hz=mode.low_hz,
            high_hz=mode.high_hz,
            widest_step_hz=mode.widest_step_hz,
            phase_of=mode.of,
            accelerations_m_per_s2=tuple(part),
            settling=Settling(tolerance=0.02, longest_wait_s=6.0),
            most_tries=8,
            most_periods=most_periods,
            flank_pairs=1,
            record_s=0.3,
        )
        used = rig.model_copy(update={"amplifier": rig.amplifier.model_copy(update={"gain_db": gain_db})})
        measurement = Measurement(name="mode", excitation=plan, ramp_s=0.4)
        with open_bench(used, confirm=confirm_simulated) as bench:
            outcome = run_measurement(bench, measurement, folder / f"{gain_db:g}dB.h5")
        with open_recording(outcome.path) as recording:
            told = [feedback_note(each) for each in recording.events]
        notes += [each for each in told if isinstance(each, ResonanceNote)]
    return notes


def backbone(specimen: Specimen, mode: Tracked, levels: np.ndarray) -> Branch:
    """Follow the model's phase resonance over the levels."""
    amplitudes = levels[[0, -1]] / (2 * np.pi * mode.start_hz) ** 2
    return phase_resonance_branch(
        specimen, mode.band_hz, (float(amplitudes[0]) / 1.5, float(amplitudes[1])), mode.of
    )


def motions_at(model: Branch, level: float) -> list[tuple[float, float]]:
    """Give frequency [Hz] and largest multiplier of each motion that the model has at a level."""
    above = np.log(model.amplitudes_m * (2 * np.pi * model.frequencies_hz) ** 2 / level)
    found = []
    for k in np.flatnonzero((above[:-1] < 0) != (above[1:] < 0)):
        share = above[k] / (above[k] - above[k + 1])
        hertz, sizes = model.frequencies_hz[k : k + 2], np.abs(model.multipliers[k : k + 2, 0])
        found.append((float(hertz @ (1 - share, share)), float(sizes @ (1 - share, share))))
    return found


def row(note: ResonanceNote, model: Branch) -> str:
    """Say what was measured at a level, and what the model has there."""
    motions = ", ".join(f"{hertz:.3f} ({size:.3g})" for hertz, size in motions_at(model, note.base_m_per_s2))
    if note.frequency_hz is None:
        found = f"not met, {note.at_hz:.2f} Hz, {note.phase_deg:.1f} degrees, {note.motion.value}"
    else:
        found = f"{note.frequency_hz:.3f} +- {note.frequency_u_hz:.3f} Hz"
    return f"{note.base_m_per_s2:8.4g} m/s2: {found}; {note.periods} periods; model [Hz] {motions or 'none'}"


def summary(notes: list[ResonanceNote], model: Branch) -> str:
    """Say how many levels were met, in how many periods, and how far from the model."""
    met = [each for each in notes if each.frequency_hz is not None]
    away = [
        abs(each.frequency_hz - hertz)
        for each in met
        for hertz, _ in motions_at(model, each.base_m_per_s2)[:1]
    ]
    # The first level of each half is searched for in settled motion.
    periods = [each.periods for each in met if each.mode_hz is None]
    first, last = met[0], met[-1]
    return (
        f"{len(met)} of {len(notes)} levels met, {first.base_m_per_s2:.3g} to {last.base_m_per_s2:.3g} m/s2, "
        f"{first.frequency_hz:.3f} to {last.frequency_hz:.3f} Hz; from the model {np.median(away):.3f} Hz "
        f"(median), {max(away):.3f} Hz at most; {min(periods)} to {max(periods)} periods, median "
        f"{np.median(periods):g}"
    )


def main() -> None:
    """Print one row for each level."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mode", type=int, choices=MODES)
    parser.add_argument("--spring", choices=("stops", "hardening"), default="stops")
    parser.add_argument("--levels", type=int, default=49)
    parser.add_argument("--periods", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rig = rig_of(given.spring, given.seed)
    specimen = specimen_of(rig)
    for number in [given.mode] if given.mode else MODES:
        mode = MODES[number]
        levels = mode.lowest * np.geomspace(1, 1e3, given.levels)
        model = backbone(specimen, mode, levels)
        with tempfile.TemporaryDirectory() as folder:
            notes = tracked(rig, mode, levels, given.periods, Path(folder))
        for each in notes:
            print(row(each, model))
        print(f"mode {number}, {given.spring}: {summary(notes, model)}", flush=True)


if __name__ == "__main__":
    main()
