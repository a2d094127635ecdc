"""One measurement from beginning to end, as a script or a command wants it."""

from collections.abc import Callable
from pathlib import Path

from ..bench.bench import RunBench
from ..host.chosen import chosen
from ..plan import Measurement
from ..recording import create_recording
from ..stopping.stop import StopSwitch
from ..stopping.stop_on_signal import stop_on_signal
from .ending import Outcome, Progress
from .low_level_check import LowLevelCheck
from .run import CreateRecording, Run


def ignore_progress(progress: Progress) -> None:
    """Watch nothing."""


def run_measurement(
    bench: RunBench,
    measurement: Measurement,
    path: Path,
    bench_check: LowLevelCheck | str = LowLevelCheck.AT_LOW_LEVEL,
    on_progress: Callable[[Progress], None] = ignore_progress,
    create: CreateRecording = create_recording,
    switch: StopSwitch | None = None,
) -> Outcome:
    """Carry out ``measurement`` on an open bench and record it at ``path`` (``NAME.h5``).

    ``on_progress`` is called after every block; ``switch`` lets others hold or end the run. Ctrl-C
    ramps down and returns an outcome whose state is ``stopped``; a second one raises KeyboardInterrupt.

    Raises
    ------
    AcquisitionError
        As `run.Run` says; the generator is silent then, and the recording, if it had begun, is
        finished as failed.

    """
    run = Run(bench, measurement, path, chosen(LowLevelCheck, bench_check), create, switch)
    # The signals stay caught until the run has been left: impatience must not interrupt the silencing.
    with stop_on_signal(run.switch, path.stem), run:
        for progress in run:
            on_progress(progress)
    return run.outcome
