"""Test how often the verdict "chaotic" is given to noise behind a static nonlinearity, and to chaos.

    python benchmarks/noise_verdicts.py --count 100 --seed 1
    python benchmarks/noise_verdicts.py --count 100 --seed 1 --shard 1/4 --save verdicts.json

Noise is narrow-band, one value per drive period, after a nonlinearity such as a cubic or a saturation. Chaos
comes from maps, from Duffing oscillators and from the specimen with stops. Its exponent is known from the
tangent; a stated lower bound above it is wrong. Regular motions are decaying transients, mains hum, slow
drifts and modulations; they are neither chaotic nor of a long period.
"""

import argparse
import json
import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
from stroboscopic_section import stroboscopic_section

import vibench.cli.environment  # noqa: F401 - one thread, as for the command, before numpy works
from vibench.analysis import motion_verdict
from vibench.analysis.chaos.verdict import MotionKind, Points
from vibench.sim import Harmonic, gong2025

DRIVE_HZ = 260.0
NOISE = 1e-5
PERIODS = 700
REGULAR, CLEARLY = 0.005, 0.1
"""Exponents per drive period: below the first a motion is regular, above the second chaotic."""
FEW = 4
"""Longest period that a verdict may state for a regular motion, in drive periods."""
BENT: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "cube": lambda x: x**3,
    "x + cube": lambda x: x + 0.5 * x**3,
    "saturation": np.tanh,
    "soft dead zone": lambda x: x**3 / (1 + x**2),
    "square": lambda x: x + 0.5 * x**2,
    "half wave": lambda x: np.maximum(x, -0.2),
    "coarse": lambda x: np.round(4 * x) / 4,
    "sine": lambda x: np.sin(1.5 * x),
    "exponential": np.exp,
}


def narrow_band(rng: np.random.Generator) -> np.ndarray:
    """Return second-order autoregressive noise with a random centre frequency and unit variance."""
    radius, turn = 1 - 10 ** rng.uniform(-1.7, -0.7), 2 * np.pi * rng.uniform(0.05, 0.45)
    values = np.zeros(PERIODS + 300)
    pushes = rng.standard_normal(values.size)
    for step in range(2, values.size):
        past = 2 * radius * np.cos(turn) * values[step - 1] - radius**2 * values[step - 2]
        values[step] = past + pushes[step]
    kept = values[300:]
    return np.asarray(kept / kept.std())


def noise_points(number: int, seed: int) -> tuple[str, Points]:
    """Return points of nonlinear noise: a series and its past value, or two series."""
    rng = np.random.default_rng((seed, number))
    name = list(BENT)[number % len(BENT)]
    line = narrow_band(rng)
    other = np.roll(line, 1) if rng.random() < 0.5 else narrow_band(rng)
    value = np.column_stack([BENT[name](each) for each in (line, other)])
    return f"noise, {name}", Points(value / (np.sqrt(2) * value.std(axis=0)), np.full(2, NOISE))


def chaos_points(number: int, seed: int) -> tuple[str, Points, float]:
    """Return points of a chaotic system and its exponent per drive period; infinite for the stops."""
    rng = np.random.default_rng((seed, number, 1))
    noise = float(rng.choice((0.0, 1e-4, 1e-3, 1e-2, 3e-2)))
    if number % 4 == 0:
        drive = Harmonic(float(rng.uniform(250, 270)), float(rng.uniform(18e-6, 22e-6)))
        value = stroboscopic_section(gong2025(), drive, 800 + PERIODS)[800:, [0, 3]]
        name, exponent = "stops", np.inf
    elif number % 4 == 1:
        name, (value, exponent) = "Henon", henon(rng.uniform(1.2, 1.4), rng.uniform(0.1, 0.3))
    else:
        name, (value, exponent) = "Duffing", duffing(rng.uniform(0.15, 0.35), rng.uniform(0.3, 0.6))
    value = value / (np.sqrt(2) * value.std(axis=0))
    value = value + noise * rng.standard_normal(value.shape)
    return f"{name}, noise {noise:g}", Points(value, np.full(2, max(noise, NOISE))), exponent


def henon(bend: float, fold: float) -> tuple[np.ndarray, float]:
    """Return points of the Henon map x' = 1 - a x^2 + y, y' = b x, and its exponent."""
    value, logs, tangent = np.empty((PERIODS + 200, 2)), [], np.array([1.0, 0.0])
    x = y = 0.1
    for each in value:
        tangent = np.array([-2 * bend * x * tangent[0] + tangent[1], fold * tangent[0]])
        x, y = 1 - bend * x * x + y, fold * x
        each[:] = x, y
        logs.append(np.log(np.linalg.norm(tangent)))
        tangent /= np.linalg.norm(tangent)
    return value[200:], float(np.mean(logs[200:]))


def duffing(damping: float, force: float, turn: float = 1.2) -> tuple[np.ndarray, float]:
    """Return points of x'' + c x' - x + x^3 = f cos(w t) once a period, and the exponent, by Runge-Kutta."""
    steps, periods = 60, PERIODS + 200
    step = 2 * math.pi / turn / steps

    def rates(x: float, v: float, dx: float, dv: float, time: float) -> tuple[float, float, float, float]:
        pushed = force * math.cos(turn * time)
        return v, pushed - damping * v + x - x**3, dv, -damping * dv + (1 - 3 * x * x) * dx

    now, value, logs = (0.5, 0.1, 1.0, 0.0), np.empty((periods, 2)), []
    for period in range(periods):
        for place in range(period * steps, (period + 1) * steps):
            slopes = [rates(*now, place * step)]
            for part in (0.5, 0.5, 1.0):
                moved = (each + part * step * slope for each, slope in zip(now, slopes[-1], strict=True))
                slopes.append(rates(*moved, (place + part) * step))
            changes = (
                first + 2 * second + 2 * third + last
                for first, second, third, last in zip(*slopes, strict=True)
            )
            now = tuple(each + step / 6 * change for each, change in zip(now, changes, strict=True))
        value[period] = now[:2]
        grown = math.hypot(*now[2:])
        logs.append(math.log(grown))
        now = (*now[:2], now[2] / grown, now[3] / grown)
    return value[200:], float(np.mean(logs[200:]))


def regular_points(number: int, seed: int) -> tuple[str, Points]:
    """Return points of a regular motion about one point."""
    rng = np.random.default_rng((seed, number, 2))
    size, place = 10 ** rng.uniform(-2.5, -0.3), np.arange(PERIODS)
    noise = float(10 ** rng.uniform(-5, -2.5))
    kind = ("transient", "hum", "two hums", "drift", "modulated", "1/f")[number % 6]
    angle, start = 2 * np.pi * rng.uniform(0, 0.5), rng.uniform(0, 2 * np.pi)
    if kind == "transient":
        moved = np.exp((1j * angle - 10 ** rng.uniform(-3.5, -1.5)) * place)
    elif kind == "hum":
        moved = np.exp(
            2j * np.pi * rng.choice((50, 60, 100, 150)) * (1 + rng.uniform(-4e-4, 4e-4)) / DRIVE_HZ * place
        )
    elif kind == "two hums":
        moved = sum(np.exp(2j * np.pi * each / DRIVE_HZ * place) / each for each in (50.0, 100.0, 150.0)) * 50
    elif kind == "drift":
        moved = np.polynomial.Polynomial(rng.standard_normal(4))(place / PERIODS)
    elif kind == "modulated":
        moved = np.sin(2 * np.pi * rng.uniform(0.3, 30) * place / PERIODS) * np.exp(1j * start)
    else:
        lines = np.fft.rfft(rng.standard_normal(PERIODS))
        lines[1:] /= np.arange(1, lines.size) ** rng.uniform(0.3, 1)
        moved = np.fft.irfft(lines, PERIODS) * np.exp(1j * start)
    moved = size * np.asarray(moved * np.exp(1j * start), dtype=complex) / np.max(np.abs(moved))
    value = np.column_stack((0.7 + moved.real, moved.imag)) + noise * rng.standard_normal((PERIODS, 2))
    return f"regular, {kind}", Points(value, np.full(2, noise))


def draw_verdicts(number: int, seed: int) -> dict[str, str]:
    """Return the verdicts for one draw of each kind; wrong ones begin with WRONG."""
    name, points = noise_points(number, seed)
    kind = motion_verdict(points, DRIVE_HZ).kind
    found = {name: f"{'WRONG ' if kind is MotionKind.CHAOTIC else ''}{kind.value}"}
    name, points, exponent = chaos_points(number, seed)
    verdict = motion_verdict(points, DRIVE_HZ)
    least = verdict.least_exponent_per_s
    is_wrong = exponent < REGULAR and verdict.kind is MotionKind.CHAOTIC
    is_wrong |= least is not None and least > exponent * DRIVE_HZ
    is_wrong |= CLEARLY < exponent < np.inf and verdict.kind in {
        MotionKind.PERIODIC,
        MotionKind.QUASI_PERIODIC,
    }
    bound = "" if least is None else f", at least {least:.3g} of {exponent * DRIVE_HZ:.3g} per s"
    name = (
        f"{'chaos' if exponent > CLEARLY else 'hardly chaos' if exponent > REGULAR else 'no chaos'}, {name}"
    )
    found[name] = f"{'WRONG ' if is_wrong else ''}{verdict.kind.value}{bound if is_wrong else ''}"
    name, points = regular_points(number, seed)
    verdict = motion_verdict(points, DRIVE_HZ)
    # A modulation may repeat after many whole drive periods.
    is_long = (verdict.period or 1) > FEW and not name.endswith("modulated")
    is_wrong = verdict.kind is MotionKind.CHAOTIC or is_long
    found[name] = f"{'WRONG ' if is_wrong else ''}{verdict.kind.value} {verdict.period or ''}".strip()
    return found


def main() -> None:
    """Compute all verdicts and count them."""
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
        if any(key.startswith(f"{number}: ") for key in found):
            continue
        found |= {f"{number}: {name}": said for name, said in draw_verdicts(number, asked.seed).items()}
        if asked.save is not None:
            asked.save.write_text(json.dumps(found), encoding="utf-8")
    count = Counter((key.split(": ")[1], kind) for key, kind in found.items())
    for (name, kind), number in sorted(count.items()):
        print(f"{name}: {kind} {number}")
    wrong = [key for key, kind in found.items() if kind.startswith("WRONG")]
    print(f"wrong: {len(wrong)} of {len(found)}: {', '.join(wrong)}")


if __name__ == "__main__":
    main()
