"""Analyse published measurements of control-based continuation; compare with the authors' values.

    python benchmarks/published_branches.py [FOLDER --rate 5000]

The script imports limit cycles of an airfoil in wind, held at the University of Bristol, with an import
mapping (source and licence: tests/analysis/exchange/flutter_rig/README.md). For each it prints frequency,
amplitude of the heave over five periods at a time (mean, smallest, largest), and how invasive the control
was: the fundamental of control target minus response, over that of the response. Beside them are the authors'
amplitude, measured over five periods before the samples were stored, and the largest heave minus its mean,
which their script computes from the samples. With a FOLDER, the complete published files are used.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from vibench.acquisition import load_toml, open_recording
from vibench.analysis.exchange import ImportMapping, import_recording
from vibench.analysis.tones import fit_sine, steady_phase, track_orders

EXCERPTS = Path(__file__).parents[1] / "tests/analysis/exchange/flutter_rig"
NEAR_HZ, PERIODS = 2.45, 5
ORDERS = (1.0, 2.0, 3.0)


@dataclass(frozen=True)
class HeldCycle:
    """One held limit cycle, as analysed here and as stated; lengths in metres."""

    name: str
    wind_m_per_s: float
    frequency_hz: float
    stated_hz: float
    heave_m: np.ndarray
    """Amplitude of the heave over each five periods."""
    stated_m: float
    largest_m: float
    invasive: float
    """Mean fundamental of control target minus response, over that of the response."""
    criterion: float
    """Criterion of the authors' search, the root of the difference of both squares [V]."""
    stated_criterion: float


def read_cycle(path: Path, mapping: ImportMapping, folder: Path) -> HeldCycle:
    """Import a file and analyse the recording."""
    stated = loadmat(path, variable_names=["amplitude", "freq_actual", "Wind_sped", "error_tol"])
    metres_per_volt = mapping.channels[0].scale
    with open_recording(import_recording(path, mapping, folder / f"{path.stem}.h5")) as recording:
        rate_hz = recording.sample_rate_hz
        heave, target = (recording.read(each) for each in ("heave", "target"))
    frequency_hz = fit_sine(heave, rate_hz, NEAR_HZ).frequency_hz
    phase = steady_phase(heave.size, frequency_hz / rate_hz, 0.0)
    interval = round(PERIODS * rate_hz / frequency_hz)
    response, wanted = (
        track_orders(each, phase, interval_samples=interval, orders=ORDERS).order(1.0)
        for each in (heave, target)
    )
    sizes = np.abs(response)
    return HeldCycle(
        name=path.stem,
        wind_m_per_s=stated["Wind_sped"].item(),
        frequency_hz=frequency_hz,
        stated_hz=stated["freq_actual"].item(),
        heave_m=sizes,
        stated_m=stated["amplitude"].item() * metres_per_volt,
        largest_m=float(heave.max() - heave.mean()),
        invasive=float(np.abs(wanted - response).mean() / sizes.mean()),
        criterion=float(abs(sizes.mean() ** 2 - np.abs(wanted).mean() ** 2) ** 0.5 / metres_per_volt),
        stated_criterion=stated["error_tol"].item(),
    )


def read_cycles(source: Path, mapping: ImportMapping) -> list[HeldCycle]:
    """Analyse all files of a folder."""
    with tempfile.TemporaryDirectory() as folder:
        return [read_cycle(each, mapping, Path(folder)) for each in sorted(source.glob("CBC_*stable_*.mat"))]


def main() -> None:
    """Print one row of a table for each limit cycle."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", default=EXCERPTS)
    parser.add_argument("--rate", type=float)
    given = parser.parse_args()
    mapping = load_toml(EXCERPTS / "mapping.toml", ImportMapping)
    if given.rate is not None:
        mapping = mapping.model_copy(update={"sample_rate_hz": given.rate})
    for each in read_cycles(given.folder, mapping):
        heave = 1e3 * each.heave_m
        print(
            f"| {each.name} | {each.wind_m_per_s:.3g} | {each.frequency_hz:.4g} | {each.stated_hz:.4g} | "
            f"{heave.mean():.2f} ({heave.min():.2f} to {heave.max():.2f}) | {1e3 * each.stated_m:.2f} | "
            f"{1e3 * each.largest_m:.2f} | {each.invasive:.1%} | {1e3 * each.criterion:.0f} | "
            f"{1e3 * each.stated_criterion:.0f} |"
        )


if __name__ == "__main__":
    main()
