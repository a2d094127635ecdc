"""Small intact recordings to be mutated: three excitations, a gap, a result, an interrupted recording."""

import shutil
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from vibench.acquisition import open_recording
from vibench.acquisition.plan import Dwell, SineSweep, StreamedNoise
from vibench.acquisition.recording import RecordingState, ResultArray, part_of, recover
from vibench.sim import gong2025

from ..analysis.synthetic_recordings import (
    RATE,
    VOLTS_PER_METRE,
    Part,
    chirp,
    noise_band,
    sine,
    start_recording,
)

SETTLE_S, DWELL_S, SWEEP_S, NOISE_S = 0.3, 1.0, 2.0, 3.0
FREE = gong2025(contact="linear")


def _dwell(folder: Path, name: str, **more: object) -> object:
    motion = sine(SETTLE_S + DWELL_S, 260.0, 1e-6)
    plan = Dwell(amplitude_vpp=2e-2, frequency_hz=260.0, settle_s=SETTLE_S, duration_s=DWELL_S)
    part = Part("dwell", SETTLE_S, SETTLE_S + DWELL_S, {"frequency_hz": 260.0})
    # m0 moves like the base with three times the amplitude; no check of a file depends on it.
    velocity = 3 * np.gradient(motion.displacement_m, 1 / RATE)
    return start_recording(folder, plan, motion, velocity, [part], name=name, **more)


def _sweep(folder: Path) -> object:
    motion = chirp(SWEEP_S, 240.0, 290.0, 1e-6)
    plan = SineSweep(amplitude_vpp=2e-2, start_hz=240.0, stop_hz=290.0, duration_s=SWEEP_S, settle_s=0.0)
    velocity = 3 * np.gradient(motion.displacement_m, 1 / RATE)
    return start_recording(folder, plan, motion, velocity, [Part("sweep", 0.0, SWEEP_S, {})], name="sweep")


def _noise(folder: Path) -> object:
    motion, velocity = noise_band(NOISE_S, 50.0, 600.0, 1e-6, seed=3)
    plan = StreamedNoise(
        amplitude_vpp=9e-2, band_start_hz=50.0, band_stop_hz=600.0, settle_s=0.0, duration_s=NOISE_S, seed=3
    )
    part = Part("noise", 0.0, NOISE_S, {})
    assert VOLTS_PER_METRE * motion.displacement_m.max() < 5.0
    return start_recording(folder, plan, motion, velocity, [part], name="noise", hole=(9000, 9100))


def _save_result(path: Path) -> None:
    frequency = np.linspace(0.0, 500.0, 6)
    arrays = {
        "H": ResultArray(np.exp(1j * frequency), "m s-1 V-1", ("frequency",)),
        "frequency": ResultArray(frequency, "Hz"),
    }
    with open_recording(path) as recording:
        recording.save_results("transmission", arrays, {"window": "hann", "overlap": 0.5})


@cache
def good_recordings() -> dict[str, bytes]:
    """Return the bytes of one recording of each kind, by file name."""
    with tempfile.TemporaryDirectory(prefix="vibench_corpus_") as name:
        folder = Path(name)
        for writer in (_dwell(folder, "dwell"), _sweep(folder), _noise(folder)):
            writer.log("mark", "somebody knocked")
            writer.finish(RecordingState.COMPLETE, "the plan was carried out")
        shutil.copy(folder / "dwell.h5", folder / "with_result.h5")
        _save_result(folder / "with_result.h5")
        cut = _dwell(folder, "cut_off", samples=7000)
        cut._committer.close()  # the state of a file whose program ended here
        cut._disk.close()
        part = part_of(folder / "cut_off.h5")
        kept = part.read_bytes()
        shutil.copy(recover(part), folder / "recovered.h5")
        (folder / "cut_off.h5").rename(folder / "cut_off.h5.part")
        (folder / "cut_off.h5.part").write_bytes(kept)
        return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}
