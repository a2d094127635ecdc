"""How often linear noise behind a static nonlinearity is called chaotic, and how often chaos is.

    python benchmarks/noise_verdicts.py --count 100 --seed 1
    python benchmarks/noise_verdicts.py --count 100 --seed 1 --shard 1/4 --save verdicts.json

The points are narrow-band noise, one value a drive period, through a cubic, a saturation, a soft dead zone
or a square. Chaos comes from maps and from the specimen with stops.
"""

import argparse
import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

import vibench.cli.blas_threads  # noqa: F401 - one thread, as for the command, before numpy works
from vibench.analysis import motion_verdict
from vibench.analysis.chaos.period import Points
from vibench.sim import Harmonic, gong2025
from vibench.sim.motion.poincare import stroboscopic_section

DRIVE_HZ = 260.0
NOISE = 1e-5
PERIODS = 700
BENT: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "cube": lambda x: x**3,
    "x + cube": lambda x: x + 0.5 * x**3,
    "saturation": np.tanh,
    "soft dead zone": lambda x: x**3 / (1 + x**2),
    "square": lambda x: x + 0.5 * x**2,
}


def narrow_band(rng: np.random.Generator) -> np.ndarray:
    """Give autoregressive noise of the second order with a random line, of unit variance."""
    radius, turn = 1 - 10 ** rng.uniform(-1.7, -0.7), 2 * np.pi * rng.uniform(0.05, 0.45)
    values = np.zeros(PERIODS + 300)
    pushes = rng.standard_normal(values.size)
    for step in range(2, values.size):
        past = 2 * radius * np.cos(turn) * values[step - 1] - radius**2 * values[step - 2]
        values[step] = past + pushes[step]
    kept = values[300:]
    return np.asarray(kept / kept.std())


def noise_points(number: int, seed: int) -> tuple[str, Points]:
    """Draw noise; displacement and velocity are it and its past, or two series, bent alike."""
    rng = np.random.default_rng((seed, number))
    name = list(BENT)[number % len(BENT)]
    line = narrow_band(rng)
    other = np.roll(line, 1) if rng.random() < 0.5 else narrow_band(rng)
    value = np.column_stack([BENT[name](each) for each in (line, other)])
    return f"noise, {name}", Points(value / (np.sqrt(2) * value.std(axis=0)), np.full(2, NOISE))


def chaos_points(number: int, seed: int) -> tuple[str, Points]:
    """Draw a motion whose exponent is positive."""
    rng = np.random.default_rng((seed, number, 1))
    if number % 2:
        value = np.empty((PERIODS, 2))
        x, y = 0.1 * rng.random(2)
        for each in value:
            x, y = 1 - 1.4 * x * x + y, 0.3 * x
            each[:] = x, y
        name = "chaos, map"
    else:
        drive = Harmonic(float(rng.uniform(250, 270)), float(rng.uniform(18e-6, 22e-6)))
        value = stroboscopic_section(gong2025(), drive, 800 + PERIODS)[800:, [0, 3]]
        name = "chaos, stops"
    return name, Points(value / (np.sqrt(2) * value.std(axis=0)), np.full(2, NOISE))


def main() -> None:
    """Judge and count."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shard", default="1/1", help="which part: 3/10 is the third of ten")
    parser.add_argument("--save", type=Path, metavar="FILE.json")
    asked = parser.parse_args()
    part, of = (int(each) for each in asked.shard.split("/"))
    is_begun = asked.save is not None and asked.save.exists()
    found: dict[str, str] = json.loads(asked.save.read_text("utf-8")) if is_begun else {}
    for number in range(part - 1, asked.count, of):
        for draw in (noise_points, chaos_points):
            name, points = draw(number, asked.seed)
            key = f"{number}: {name}"
            if key not in found:
                found[key] = motion_verdict(points, DRIVE_HZ).kind.value
                if asked.save is not None:
                    asked.save.write_text(json.dumps(found), encoding="utf-8")
    count = Counter((key.split(": ")[1], kind) for key, kind in found.items())
    for (name, kind), number in sorted(count.items()):
        print(f"{name}: {kind} {number}")


if __name__ == "__main__":
    main()
