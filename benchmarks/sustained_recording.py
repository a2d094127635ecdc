"""Record four channels at 51.2 kS/s for minutes of rig time, through nidaqmx: speed and memory.

    python benchmarks/sustained_recording.py [MINUTES]

The script prints the real-time factor (seconds of signal per second of wall time), processor time per second
of signal, and memory after each minute. Everything runs in one process, including the simulated instruments.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.plan import Dwell, Measurement
from vibench.acquisition.run.ending import Progress

ROOT = Path(__file__).resolve().parent.parent
MINUTE_S = 60.0


def resident_mb() -> float:
    """Return the present memory of the process if the system reports it, otherwise its peak [MB]."""
    try:
        for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) / 1024
    except OSError:
        pass
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def record_dwell(minutes: float, folder: Path) -> list[float]:
    """Record a dwell with impacts; return the memory at the end of each minute [MB]."""
    memory_mb: list[float] = []

    def watch(progress: Progress) -> None:
        if progress.elapsed_s >= MINUTE_S * (len(memory_mb) + 1):
            memory_mb.append(resident_mb())

    excitation = Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=1, duration_s=minutes * MINUTE_S)
    with open_bench(ROOT / "hardware_configs" / "virtual_rig.toml") as bench:
        run_measurement(
            bench, Measurement(name="sustained", excitation=excitation), folder / "run.h5", on_progress=watch
        )
    return memory_mb


def main() -> None:
    """Record, and print speed and memory."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        begin_s, begin_cpu_s = time.perf_counter(), time.process_time()
        memory_mb = record_dwell(minutes, folder)
        wall_s, cpu_s = time.perf_counter() - begin_s, time.process_time() - begin_cpu_s
        with open_recording(folder / "run.h5") as recording:
            signal_s, gaps = recording.duration_s, len(recording.gaps)
            size = (folder / "run.h5").stat().st_size
            samples = recording.samples * len(recording.roles)
    print(f"signal            {signal_s:.1f} s, 4 channels at 51.2 kS/s, {gaps} gaps")
    print(f"real-time factor  {signal_s / wall_s:.1f} (finishing the file included)")
    print(f"processor time    {cpu_s / signal_s * 1e3:.1f} ms per second of signal")
    print(f"file              {size / samples:.2f} bytes per sample")
    print("memory by minute  " + ", ".join(f"{each:.0f}" for each in memory_mb) + " MB")


if __name__ == "__main__":
    main()
