"""Measure the cost of one frame of a live view: 4 channels at 51.2 kS/s, 20 frames a second, 2 s in view.

    python benchmarks/live_view.py

The script prints the processor time per frame of all computations of `vibench.analysis.live`, without
painting. It also prints the share of frames in which an impact of three samples is visible, for the envelope
and for drawing every n-th sample.
"""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from vibench.analysis.live import LiveChannel, LiveView, envelope

RATE_HZ, BLOCK, COLUMNS, SPAN_S = 51_200.0, 2560, 1000, 2.0
FRAMES = 200
A0_M = 4e-6
CHANNELS = (
    LiveChannel("drive_voltage", "V", 2.0, 5.0),
    LiveChannel("amplifier_voltage", "V", 10.0, 5.0),
    LiveChannel("base_acceleration", "m/s²", 100.0, 5.0),
    LiveChannel("m0_velocity", "m/s", 0.25, 5.0),
)


def main() -> None:
    """Measure the cost per frame and print it."""
    rng = np.random.default_rng(1)
    view = LiveView(CHANNELS, RATE_HZ, band_hz=(150.0, 350.0))
    frames: dict[str, Callable[[], object]] = {
        "lanes": lambda: view.time_histories(SPAN_S, COLUMNS),
        "spectrum": view.spectrum,
        "transmission": view.frequency_response,
        "phase portrait and section": view.portrait,
        "course of the sweep": view.history,
    }
    spent = dict.fromkeys(("samples in, points, impacts, meters", *frames), 0.0)
    worst_s = 0.0
    for number in range(FRAMES + 40):
        first = number * BLOCK
        block = _block(first, rng)
        frame_s = 0.0
        tasks = {"samples in, points, impacts, meters": partial(view.add, first, block), **frames}
        for name, task in tasks.items():
            begun = time.process_time()
            task()
            taken_s = time.process_time() - begun
            frame_s += taken_s
            if number >= 40:
                spent[name] += taken_s
        worst_s = max(worst_s, frame_s) if number >= 40 else 0.0
    print(f"{'processor time per frame':<40} ms")
    for name, total_s in spent.items():
        print(f"{name:<40} {1e3 * total_s / FRAMES:.2f}")
    print(f"{'together':<40} {1e3 * sum(spent.values()) / FRAMES:.2f}  (largest {1e3 * worst_s:.1f})")
    _print_share(rng)


def _block(first: int, rng: np.random.Generator) -> "np.ndarray[tuple[int, int], np.dtype[np.float32]]":
    time_s = (first + np.arange(BLOCK)) / RATE_HZ
    phase = 2 * np.pi * (200.0 * time_s + 0.5 * time_s**2)
    omega = 2 * np.pi * (200.0 + time_s)
    rows = np.stack(
        (
            np.cos(phase),
            3 * np.cos(phase),
            -A0_M * omega**2 * np.cos(phase),
            -3 * A0_M * omega * np.sin(phase),
        )
    )
    rows /= np.array([[each.units_per_volt] for each in CHANNELS])
    return (rows + 1e-5 * rng.standard_normal(rows.shape)).astype(np.float32)


def _print_share(rng: np.random.Generator) -> None:
    """Print the share of frames of a scrolling window in which an impact of three samples is drawn."""
    count = round(SPAN_S * RATE_HZ)
    samples = np.zeros(count, dtype=np.float32)
    step = count // COLUMNS
    by_envelope = by_step = 0
    tries = 2000
    for place in rng.integers(0, count - 3, tries):
        samples[place : place + 3] = 1.0
        by_envelope += float(envelope(samples, COLUMNS)[1].max()) == 1.0
        by_step += float(samples[::step].max()) == 1.0
        samples[place : place + 3] = 0.0
    print(f"an impact of 3 samples is seen in {by_envelope / tries:.1%} of the frames; ", end="")
    print(f"with every {step}th sample in {by_step / tries:.1%}")


if __name__ == "__main__":
    main()
