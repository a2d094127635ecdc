"""Test how often bounds of resonances from streamed noise contain the truth, which is a closed form.

    python benchmarks/resonance_coverage.py --count 20 --seed 1
    python benchmarks/resonance_coverage.py --count 20 --seed 1 --shard 1/10 --save part1.json
    python benchmarks/resonance_coverage.py --count 1 --seed 1 --scenes random --random 120

A scene has one mode with a given damping ratio, window and sensor noise, or two or three close modes, or the
modes of the paper's specimen. `--random` adds random scenes of two or three close modes. Each row shows how
many modes were found, and how often k = 2 contains frequency, damping and peak. A mode whose fit is reported
as explained, but is more than five standard deviations off, counts as wrong.
"""

import argparse
import json
from collections.abc import Iterator
from itertools import chain, product
from pathlib import Path

import numpy as np

import vibench.cli.environment  # noqa: F401 - one thread, as for the command, before numpy works
from vibench.analysis.frequency_response.resonance import resonances
from vibench.analysis.frequency_response.transmissibility import transmissibility
from vibench.sim import gong2025

RATE_HZ = 2048.0
SECONDS = 60.0
WINDOWS = {"hann": 0.5, "blackmanharris": 0.75, "flattop": 0.75, "boxcar": 0.0}
"""Windows, with the overlap of their segments."""
DAMPINGS = (0.0005, 0.0015, 0.005, 0.015, 0.02, 0.05)
CLOSE_HZ = (2.0, 4.0)
"""Distances of close modes with a damping ratio of 1 % [Hz]."""
SHARES = ((1.0, 1.0), (1.0, 0.4), (1.0, -0.7), (1.0, 0.6, 1.0))
"""Static shares of the two or three close modes."""
NOISES = (0.001, 0.05)
"""Noise of the response sensor, relative to the response."""
DAMPING_TIMES_S = (4e-6, 2e-5)
"""Damping times of the paper's specimen [s]."""
WRONG = 5.0

Mode = tuple[float, float, float]
"""Natural frequency [Hz], damping ratio and static share."""
Scene = tuple[str, float, float, list[Mode]]
"""Window, noise, segment [s] and modes."""


def transmission(frequency_hz: np.ndarray, modes: list[Mode]) -> np.ndarray:
    """Return the transmissibility 1 + sum of share / (1 - r^2 + 2 i zeta r)."""
    value = np.ones(frequency_hz.size, dtype=complex)
    for natural_hz, damping, share in modes:
        ratio = frequency_hz / natural_hz
        value += share / (1 - ratio**2 + 2j * damping * ratio)
    return value


def peak(modes: list[Mode], natural_hz: float, damping: float) -> float:
    """Return the largest magnitude near a mode."""
    fine_hz = natural_hz * (1 + np.linspace(-2 * damping, 2 * damping, 20001))
    return float(np.abs(transmission(fine_hz, modes)).max())


def paper_modes(damping_time_s: float) -> list[Mode]:
    """Return the modes of the paper's specimen without stops, as seen at m0."""
    specimen = gong2025(damping_time_s=damping_time_s)
    root = np.sqrt(np.diag(specimen.mass_matrix))
    _, vectors = np.linalg.eigh(specimen.stiffness_matrix / np.outer(root, root))
    shares = vectors[0] / root[0] * (root @ vectors)
    modes = zip(specimen.natural_frequencies_hz, specimen.damping_ratios, shares, strict=True)
    return [(float(hz), float(damping), float(share)) for hz, damping, share in modes]


def scenes() -> Iterator[tuple[str, Scene]]:
    """Yield every scene with its name."""
    for window, damping, noise in product(WINDOWS, DAMPINGS, NOISES):
        yield f"{window:15} {damping:7.2%} noise {noise:g}", (window, noise, 4.0, [(200.0, damping, 1.0)])
    for window, apart_hz, shares in product(WINDOWS, CLOSE_HZ, SHARES):
        modes = [(200.0 + apart_hz * place, 0.01, share) for place, share in enumerate(shares)]
        yield f"{window:15} close {apart_hz:g} Hz {shares}", (window, 0.01, 2.0, modes)
    for window, damping_s, noise in product(WINDOWS, DAMPING_TIMES_S, NOISES):
        modes = paper_modes(damping_s)
        yield f"{window:15} paper {damping_s:g} s noise {noise:g}", (window, noise, 1.0, modes)


def random_scene(rng: np.random.Generator) -> Scene:
    """Return a random scene of two or three modes, 0.25 to 3 half-power bandwidths apart."""
    natural_hz, damping = float(rng.uniform(150.0, 300.0)), float(10 ** rng.uniform(-2.3, -1.5))
    apart_hz = float(rng.uniform(0.25, 3.0)) * 2 * damping * natural_hz
    modes = [
        (
            natural_hz + apart_hz * place,
            damping * float(rng.uniform(0.8, 1.25)),
            float(rng.choice([-1.0, 1.0], p=[0.3, 0.7]) * rng.uniform(0.3, 1.2)) if place else 1.0,
        )
        for place in range(int(rng.integers(2, 4)))
    ]
    window, noise = str(rng.choice(list(WINDOWS))), float(10 ** rng.uniform(-3.0, -1.3))
    return window, noise, float(rng.choice([1.0, 2.0, 4.0])), modes


def scores(window: str, noise: float, segment_s: float, modes: list[Mode], rng: np.random.Generator) -> dict:
    """Simulate one measurement; return the error over the standard deviation for each mode found."""
    samples = int(SECONDS * RATE_HZ)
    drive = rng.standard_normal(samples)
    spectrum = np.fft.rfft(drive)
    response = np.fft.irfft(spectrum * transmission(np.fft.rfftfreq(samples, 1 / RATE_HZ), modes), samples)
    response += noise * np.std(response) * rng.standard_normal(samples)
    lines = transmissibility(
        drive,
        response,
        RATE_HZ,
        segment_samples=round(segment_s * RATE_HZ),
        window=window,
        overlap=WINDOWS[window],
        estimator="drive",
        reference=drive,
    )
    errors, wrong = [], 0
    for each in resonances(lines, low_hz=0.6 * modes[0][0], high_hz=1.3 * modes[-1][0]):
        natural_hz, damping, _ = min(modes, key=lambda mode: abs(mode[0] - each.frequency_hz))
        error = [
            (each.frequency_hz - natural_hz) / each.sd_frequency_hz,
            (each.damping_ratio - damping) / each.sd_damping_ratio,
            (each.peak_magnitude - peak(modes, natural_hz, damping)) / each.sd_peak_magnitude,
        ]
        errors.append(error)
        wrong += each.is_explained and max(map(abs, error[:2])) > WRONG
    return {"modes": len(modes), "errors": errors, "wrong": int(wrong)}


def main() -> None:
    """Run the scenes of a shard and print a row for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20, help="measurements of each scene")
    parser.add_argument("--scenes", default="", help="only scenes whose names hold this text")
    parser.add_argument("--random", type=int, default=0, help="scenes of close modes drawn at random")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--shard", default="1/1", help="which part of the measurements: 3/10 is the third of ten"
    )
    parser.add_argument(
        "--save", type=Path, metavar="FILE.json", help="keep every error; resumed where it exists"
    )
    args = parser.parse_args()
    part, parts = map(int, args.shard.split("/"))
    kept = json.loads(args.save.read_text()) if args.save and args.save.exists() else {}
    drawn = (
        (f"random {number}", random_scene(np.random.default_rng((args.seed, number))))
        for number in range(args.random)
    )
    for number, (name, scene) in enumerate(chain(scenes(), drawn)):
        if args.scenes not in name:
            continue
        row = kept.setdefault(name, {})
        for draw in range(part - 1, args.count, parts):
            if str(draw) not in row:
                rng = np.random.default_rng((args.seed, number, draw))
                row[str(draw)] = scores(*scene, rng)
        if args.save:
            args.save.write_text(json.dumps(kept))
        errors = np.array([error for one in row.values() for error in one["errors"]]).reshape(-1, 3)
        held = [f"{np.mean(np.abs(column) < 2):5.0%}" for column in errors.T] if errors.size else []
        bias = np.round(errors.mean(axis=0), 1).tolist() if errors.size else []
        total = sum(one["modes"] for one in row.values())
        wrong = sum(one["wrong"] for one in row.values())
        print(
            f"{name:48} found {len(errors):3}/{total:3} wrong {wrong:2}  held {' '.join(held)}  mean {bias}",
            flush=True,
        )


if __name__ == "__main__":
    main()
