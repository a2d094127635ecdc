"""Measure backbones of three modes on the virtual rig over three decades of level; compare with a model.

    python benchmarks/backbones.py [--mode 1] [--spring hardening] [--levels 49] [--periods 150] [--seed 1]
    python benchmarks/backbones.py --superharmonic 2 --spring bumpers [--levels 13]
    python benchmarks/backbones.py --subharmonic 2 --spring bumpers [--levels 13]

The script tracks the phase resonance of each mode of the paper's specimen with a fixture of 0.6 kg. For each
level it prints the frequency, its standard uncertainty and the number of drive periods. Beside them are the
motions of the model at this level (`phase_resonance_branch`): frequency, and largest Floquet multiplier in
brackets. If no resonance was reached, it prints where the loop ended and whether that motion repeats. With
``--spring hardening`` p^3 replaces the stops (0.1 k1 p at 100 um), with ``--spring bumpers`` soft springs
behind uneven gaps (100 N/m, 0.12 k1, below at 60 and above at 30 um). The weaker levels are played with the
amplifier 30 dB lower, because the generator's setting has steps of a millivolt.

``--superharmonic 3`` tracks the 3:1 superharmonic resonance of the first mode instead, from 6 to 20 m/s2, and
``--superharmonic 2`` the 2:1 one, from 10 to 25 m/s2. ``--subharmonic 2`` tracks the one at which m0 repeats
every two drive periods, from 22 to 34 m/s2. The model for these is harmonic balance of specimen, table and
coil together, since the table also moves at those frequencies.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import root

from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.excitation.plan import Settling
from vibench.acquisition.plan import Measurement, ResonanceTracking
from vibench.acquisition.recording import ResonanceNote, feedback_note
from vibench.acquisition.rig import Rig, amplifier_of, confirm_simulated, load_rig, shaker_of, specimen_of
from vibench.sim import Branch, PhaseReference, Specimen, phase_resonance_branch
from vibench.sim.periodic.restoring_force import spring_of
from vibench_fast_loop.law import LoopTiming, SampledPlant

GAINS_DB = -20.0, 10.0
K1 = 2.1e-3 * (2 * np.pi * 100) ** 2


@dataclass(frozen=True)
class Tracker:
    """Settings for tracking one mode: frequency range, phase reference and levels of the base."""

    start_hz: float
    low_hz: float
    high_hz: float
    widest_step_hz: float
    of: PhaseReference
    lowest: float
    """The weakest level, three decades below the strongest [m/s2]."""
    turned_up: float
    """Level from which the amplifier is turned up; it is below the first contact [m/s2]."""
    band_hz: tuple[float, float]
    """Band in which the model's linear motion has this phase exactly once [Hz]."""
    harmonic: int = 1
    subharmonic: int = 1


MODES = {
    1: Tracker(94.5, 90, 170, 0.8, PhaseReference.RELATIVE, 0.02, 0.1, (92, 97)),
    2: Tracker(264, 250, 330, 3, PhaseReference.RELATIVE, 0.04, 1.0, (255, 275)),
    3: Tracker(496, 470, 530, 5, PhaseReference.ABSOLUTE, 0.05, 1.5, (490, 510)),
}


OTHERS = {
    "superharmonic": {
        2: (Tracker(47.5, 44, 53, 0.4, PhaseReference.RELATIVE, 10.0, 0.0, (44, 53), harmonic=2), 25.0),
        3: (Tracker(31.6, 29, 36, 0.3, PhaseReference.RELATIVE, 6.0, 0.0, (29, 36), harmonic=3), 20.0),
    },
    "subharmonic": {
        2: (Tracker(192, 187, 199, 0.5, PhaseReference.RELATIVE, 22.0, 0.0, (187, 199), subharmonic=2), 34.0)
    },
}
"""Settings for super- and subharmonic resonances by order, each with the highest level [m/s2]."""
ORDERS, WAVE = np.arange(20), 512
P_OVER_M0 = 24.0
"""Ratio of p to the motion of m0 in the first mode."""


def rig_of(spring: str, seed: int) -> Rig:
    """Return the virtual rig with a fixture, and with stops or another spring."""
    rig = load_rig(Path("virtual_rig"))
    changed = {
        "shaker": rig.shaker.model_copy(update={"fixture_mass_kg": 0.6}),
        "daq": rig.daq.model_copy(update={"sample_rate_hz": 10_240.0}),
        "virtual": rig.virtual.model_copy(update={"seed": seed}),
    }
    if spring == "hardening":
        cubic = {"contact": "power:3", "gap_m": 99e-6, "hertz_stiffness": 0.1 * K1 * 1e-4 / 1e-9}
        changed["specimen"] = rig.specimen.model_copy(update=cubic)
    if spring == "bumpers":
        uneven = {"contact": "linear_gap:100", "gap_m": (60e-6, 30e-6)}
        changed["specimen"] = rig.specimen.model_copy(update=uneven)
    return rig.model_copy(update=changed)


def track_mode(
    rig: Rig, mode: Tracker, levels: np.ndarray, most_periods: int, folder: Path
) -> list[ResonanceNote]:
    """Track the mode over all levels, with a higher amplifier gain at the stronger levels."""
    notes = []
    halves = np.split(levels, [np.searchsorted(levels, mode.turned_up)])
    for gain_db, part in zip(GAINS_DB, halves, strict=True):
        if not part.size:
            continue
        plan = ResonanceTracking(
            amplitude_vpp=9.0,
            start_hz=mode.start_hz,
            low_hz=mode.low_hz,
            high_hz=mode.high_hz,
            widest_step_hz=mode.widest_step_hz,
            phase_of=mode.of,
            harmonic=mode.harmonic,
            subharmonic=mode.subharmonic,
            accelerations_m_per_s2=tuple(part),
            settling=Settling(
                tolerance=0.02 if mode.subharmonic == 1 else 0.05,
                longest_wait_s=6.0 if mode.subharmonic == 1 else 15.0,
            ),
            most_tries=8 if mode.harmonic == mode.subharmonic == 1 else 12,
            most_periods=most_periods,
            flank_pairs=1,
            record_s=0.3 * mode.harmonic,
        )
        used = rig.model_copy(update={"amplifier": rig.amplifier.model_copy(update={"gain_db": gain_db})})
        measurement = Measurement(name="mode", excitation=plan, ramp_s=0.4)
        with open_bench(used, confirm=confirm_simulated) as bench:
            outcome = run_measurement(bench, measurement, folder / f"{gain_db:g}dB.h5")
        with open_recording(outcome.path) as recording:
            told = [feedback_note(each) for each in recording.events]
        notes += [each for each in told if isinstance(each, ResonanceNote)]
    return notes


def backbone(specimen: Specimen, mode: Tracker, levels: np.ndarray) -> Branch:
    """Follow the model's phase resonance over the levels."""
    amplitudes = levels[[0, -1]] / (2 * np.pi * mode.start_hz) ** 2
    return phase_resonance_branch(
        specimen, mode.band_hz, (float(amplitudes[0]) / 1.5, float(amplitudes[1])), mode.of
    )


def motions_at(model: Branch, level: float) -> list[tuple[float, float]]:
    """Return frequency [Hz] and largest multiplier of each motion of the model at a level."""
    above = np.log(model.amplitudes_m * (2 * np.pi * model.frequencies_hz) ** 2 / level)
    found = []
    for k in np.flatnonzero((above[:-1] < 0) != (above[1:] < 0)):
        share = above[k] / (above[k] - above[k + 1])
        hertz, sizes = model.frequencies_hz[k : k + 2], np.abs(model.multipliers[k : k + 2, 0])
        found.append((float(hertz @ (1 - share, share)), float(sizes @ (1 - share, share))))
    return found


def balance_peak(rig: Rig, mode: Tracker, note: ResonanceNote) -> tuple[float, float]:
    """Return frequency [Hz] and resonant amplitude [m] of the phase resonance, by harmonic balance."""
    plant = SampledPlant(amplifier_of(rig), shaker_of(rig), specimen_of(rig), LoopTiming(1e4, 0.0))
    (rates, volt), spring = plant.equations, spring_of(specimen_of(rig))
    into, relative = (each[:9] for each in plant.spring)
    turns = np.exp(2j * np.pi * np.outer(ORDERS, np.arange(WAVE)) / WAVE)
    parts = np.where(ORDERS, 2.0, 1.0)[:, None] / WAVE
    drives, count = mode.subharmonic, len(ORDERS)
    quarter = -0.5 * np.pi if 2 in (mode.harmonic, drives) else 0.0
    micro, moved = 1e-6, {}

    def states_at(hertz: float, pushes: np.ndarray) -> np.ndarray:
        return np.array(
            [
                np.linalg.solve(2j * np.pi * k / drives * hertz * np.eye(9) - rates, each)
                for k, each in zip(ORDERS, pushes, strict=True)
            ]
        )

    def base_m(hertz: float) -> float:
        return note.base_m_per_s2 / (2 * np.pi * hertz) ** 2

    def wrong(unknown: np.ndarray, at_hz: float | None) -> np.ndarray:
        """Return the residuals: p [um] at each order, base, and phase or, if given, frequency."""
        p, volts = unknown[:count] + 1j * unknown[count : 2 * count], complex(*unknown[-3:-1])
        hertz = unknown[-1] if at_hz is None else at_hz
        wave = micro * (p @ turns).real
        force = (parts * turns.conj()) @ spring.force(wave, 0 * wave)
        pushes = np.outer(force, into)
        pushes[drives] += volts * volt
        states = states_at(hertz, pushes)
        # The phasor of a sine is -i.
        base, of_m0 = states[drives][0] * 1j / base_m(hertz) - 1.0, states[mode.harmonic][3] * 1j
        moved["m"] = abs(of_m0)
        seen = np.sin(drives * np.angle(of_m0) + quarter + 0.5 * np.pi)
        left = np.concatenate([states @ relative / micro - p, [base]])
        return np.concatenate([left.real, left.imag, [seen if at_hz is None else unknown[-1] - at_hz]])

    # Start from the motion without the contact force, and the observed subharmonic.
    alone = states_at(note.at_hz, np.outer(drives == ORDERS, volt))
    volts = -1j * base_m(note.at_hz) / alone[drives][0]
    p = alone @ relative * volts / micro
    if drives > 1:
        p[1] = (
            P_OVER_M0
            * note.harmonic_m
            / micro
            * np.exp(-1j * (quarter + 0.5 * np.pi) / drives - 0.5j * np.pi)
        )
    guess = np.array([*p.real, *p.imag, volts.real, volts.imag, note.at_hz])
    if drives == 1:
        guess = root(wrong, guess, args=(note.at_hz,)).x
    found = root(wrong, guess, args=(None,))
    return (float(found.x[-1]), moved["m"]) if found.success else (np.nan, np.nan)


def compare_others(rig: Rig, spring: str, mode: Tracker, levels: np.ndarray, periods: int) -> None:
    """Track a super- or subharmonic resonance, and print it beside the model."""
    with tempfile.TemporaryDirectory() as folder:
        notes = track_mode(rig, mode, levels, periods, Path(folder))
    away = []
    for each in notes:
        hertz, moved_m = (np.nan, np.nan) if spring == "stops" else balance_peak(rig, mode, each)
        if each.frequency_hz is not None:
            away.append(abs(each.frequency_hz - hertz))
        found = each.frequency_hz or np.nan
        print(
            f"{each.base_m_per_s2:8.4g} m/s2: {found:.3f} +- {each.frequency_u_hz or np.nan:.3f} Hz, "
            f"{1e6 * each.harmonic_m:.3f} um ({each.lock.value}, {each.phase_deg:.1f} degrees, "
            f"{each.motion.value}); {each.periods} periods; model {hertz:.3f} Hz, {1e6 * moved_m:.3f} um"
        )
    print(
        f"{len(away)} of {len(notes)} levels met; from the model {max(away, default=np.nan):.3f} Hz at most"
    )


def row(note: ResonanceNote, model: Branch) -> str:
    """Return one line with the measured resonance at a level, and the motions of the model."""
    motions = ", ".join(f"{hertz:.3f} ({size:.3g})" for hertz, size in motions_at(model, note.base_m_per_s2))
    if note.frequency_hz is None:
        found = f"not met, {note.at_hz:.2f} Hz, {note.phase_deg:.1f} degrees, {note.motion.value}"
    else:
        found = f"{note.frequency_hz:.3f} +- {note.frequency_u_hz:.3f} Hz"
    return f"{note.base_m_per_s2:8.4g} m/s2: {found}; {note.periods} periods; model [Hz] {motions or 'none'}"


def summary(notes: list[ResonanceNote], model: Branch) -> str:
    """Return a summary: levels reached, periods needed, differences from the model."""
    met = [each for each in notes if each.frequency_hz is not None]
    away = [
        abs(each.frequency_hz - hertz)
        for each in met
        for hertz, _ in motions_at(model, each.base_m_per_s2)[:1]
    ]
    # Leave out the first level of each part, which is searched for in settled motion.
    periods = [each.periods for each in met if each.mode_hz is None]
    first, last = met[0], met[-1]
    return (
        f"{len(met)} of {len(notes)} levels met, {first.base_m_per_s2:.3g} to {last.base_m_per_s2:.3g} m/s2, "
        f"{first.frequency_hz:.3f} to {last.frequency_hz:.3f} Hz; from the model {np.median(away):.3f} Hz "
        f"(median), {max(away):.3f} Hz at most; {min(periods)} to {max(periods)} periods, median "
        f"{np.median(periods):g}"
    )


def main() -> None:
    """Track the requested modes and print one row for each level."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mode", type=int, choices=MODES)
    parser.add_argument("--spring", choices=("stops", "hardening", "bumpers"), default="stops")
    parser.add_argument("--levels", type=int, default=49)
    parser.add_argument("--periods", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    for kind, orders in OTHERS.items():
        parser.add_argument(f"--{kind}", type=int, choices=orders)
    given = parser.parse_args()
    rig = rig_of(given.spring, given.seed)
    for kind, orders in OTHERS.items():
        if order := getattr(given, kind):
            mode, highest = orders[order]
            levels = np.geomspace(mode.lowest, highest, given.levels)
            compare_others(rig, given.spring, mode, levels, given.periods)
            return
    specimen = specimen_of(rig)
    for number in [given.mode] if given.mode else MODES:
        mode = MODES[number]
        levels = mode.lowest * np.geomspace(1, 1e3, given.levels)
        model = backbone(specimen, mode, levels)
        with tempfile.TemporaryDirectory() as folder:
            notes = track_mode(rig, mode, levels, given.periods, Path(folder))
        for each in notes:
            print(row(each, model))
        print(f"mode {number}, {given.spring}: {summary(notes, model)}", flush=True)


if __name__ == "__main__":
    main()
