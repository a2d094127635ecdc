"""`vibench twin`: the live twin, which estimates the hidden motion of a running measurement."""

import os
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated

import numpy as np

from vibench.acquisition import AcquisitionError
from vibench.acquisition.engine import (
    DRIVING,
    EngineClient,
    EngineError,
    EngineGone,
    EngineStatus,
    SampleSlice,
    TwinStatus,
    require_ended,
    the_engine,
)
from vibench.acquisition.rig import Rig, specimen_of
from vibench.analysis.hidden_motion import (
    Baseline,
    LiveMotion,
    LiveTwin,
    baseline_path,
    keep_baseline,
    kept_baseline,
)
from vibench.sim import Specimen
from vibench.sim.operating_system.this import lower_priority

from .options import option
from .output import console, print_warnings
from .scene_options import SpecimenOption, read_specimen
from .watch import Pid

NICE = 5
POLL_S = 0.01
"""Interval between two polls of the engine during a run [s]."""
IDLE_S = 0.2
"""Interval between two polls of the engine if there is no run [s]."""
PIECE_S = 0.1
"""Duration of the samples that are processed and reported together [s]."""
LATEST_S = 3.0
"""Largest delay of the twin behind the measurement [s]; if the delay is larger, the twin skips samples."""
SHOWN_S = 0.05
SHOWN_POINTS = 320
_WORTH_OF_GAP = 0.25
"""Largest error of a displayed forecast of p, as a fraction of the smaller gap."""


@dataclass
class _Following:
    client: EngineClient
    rig: Rig
    specimen: Specimen
    live: LiveTwin
    rows: tuple[int, int]
    """Row numbers of the base acceleration and the m0 velocity in the array of samples."""
    run_id: int = -1
    plan: str = ""
    missed: int = 0
    start_s: float = 0.0
    busy_s: float = 0.0
    is_kept: bool = False

    def look(self) -> float:
        """Process and report new samples; return the time to wait before the next call [s]."""
        status = self.client.status()
        if status.state not in DRIVING or status.run is None or not _shows_m0(status):
            return IDLE_S
        if status.run_id != self.run_id:
            self.run_id, self.plan = status.run_id, "" if status.run is None else status.run.plan
            baseline = kept_baseline(baseline_path(self.rig, self.specimen))
            self.live.begin_run(None if baseline is None else baseline.levels.get(self.plan))
            self.missed, self.is_kept = 0, False
            self.start_s, self.busy_s = time.monotonic(), time.process_time()
        rate_hz = 1.0 if status.bench is None else status.bench.sample_rate_hz
        waiting = status.samples - self.live.next_sample
        if waiting <= 0:
            return POLL_S
        is_late = waiting > LATEST_S * rate_hz
        # If too many samples have arrived since the status, the request skips the oldest samples.
        most = round((PIECE_S if is_late else 2 * LATEST_S) * rate_hz)
        piece = self.client.look(self.live.next_sample, most=most)
        if piece.run_id != self.run_id or piece.volts.shape[1] == 0:
            return POLL_S
        self.missed += piece.first_sample - self.live.next_sample
        self._take(piece, status, round(PIECE_S * rate_hz))
        return 0.0

    def _take(self, piece: SampleSlice, status: EngineStatus, most: int) -> None:
        assert status.bench is not None
        gains = [status.bench.channels[row].units_per_volt for row in self.rows]
        base, velocity = (
            gain * piece.volts[row].astype(np.float64) for row, gain in zip(self.rows, gains, strict=True)
        )
        frequency_hz = None if status.run is None else status.run.frequency_hz
        for begin in range(0, base.size, most):
            part = slice(begin, begin + most)
            for sentence in self.live.take(
                piece.first_sample + begin, base[part], velocity[part], frequency_hz
            ):
                self.client.note_change(sentence)
        self._keep_baseline()
        self.client.publish_twin(self._status(piece.sample_rate_hz))

    def _keep_baseline(self) -> None:
        """Store the estimated parameters and usual residual once, as a baseline for checking later runs."""
        live, watch = self.live, self.live.watch
        if self.is_kept or watch.usual is None or watch.has_changed or not live.numbers:
            return
        self.is_kept = True
        path = baseline_path(self.rig, self.specimen)
        before = kept_baseline(path)
        if before is None:
            before = Baseline(bench=self.rig.name, since=datetime.now(UTC), numbers=live.numbers, levels={})
        if self.plan not in before.levels:
            levels = {**before.levels, self.plan: watch.usual}
            try:
                keep_baseline(before.model_copy(update={"levels": levels}), path)
            except OSError as error:  # for example, a full disk: the twin continues
                reason = f"{path} could not be written ({error.strerror})"
                print_warnings([f"{reason}: the baseline of this run is not stored; free disk space"])

    def _status(self, rate_hz: float) -> TwinStatus:
        newest = self.live.newest
        step = max(1, round(SHOWN_S * rate_hz / SHOWN_POINTS))
        shown = newest.p[-round(SHOWN_S * rate_hz) :][::-1][::step][::-1]
        forecast, error = _useful_forecast(newest, step)
        used_s = time.process_time() - self.busy_s
        return TwinStatus(
            pid=os.getpid(),
            state=newest.state.value,
            sentence=newest.why,
            run_id=self.run_id,
            end_sample=newest.first + newest.p.size,
            step_s=step / rate_hz,
            p_m=tuple(None if np.isnan(each) else each for each in shown.tolist()),
            forecast_m=forecast,
            forecast_error_m=error,
            stops_m=(-newest.gaps_m[0], newest.gaps_m[1]),
            numbers=tuple(each.row[:2] for each in self.live.found),
            level=newest.level if np.isfinite(newest.level) else None,
            limit=newest.limit if np.isfinite(newest.limit) else None,
            busy_share=used_s / max(time.monotonic() - self.start_s, 1e-3),
            missed_s=self.missed / rate_hz,
        )


def _shows_m0(status: EngineStatus) -> bool:
    """Return whether the vibrometer measures m0; in a scan, the vibrometer measures other points."""
    return status.bench is not None and "m0_velocity" in [each.role for each in status.bench.channels]


def _useful_forecast(newest: LiveMotion, step: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the forecast and its errors up to the first error that is too large to display."""
    if newest.forecast is None:
        return (), ()
    error = newest.forecast.error
    count = int(np.argmin(error < _WORTH_OF_GAP * min(newest.gaps_m))) if error.size else 0
    part = slice(0, count, step)
    return tuple(newest.forecast.p[part].tolist()), tuple(error[part].tolist())


def twin(
    pid: Pid = None,
    specimen: SpecimenOption = None,
    new_baseline: Annotated[bool, option("Start a new baseline after changing the specimen.")] = False,
) -> None:
    """Estimate the hidden motion during a measurement, and report changes of the specimen."""
    lower_priority(NICE)  # measurement and window have priority
    engine = the_engine(pid)
    with EngineClient.attach(engine.address) as client, ThreadPoolExecutor(1) as executor:
        try:
            rig = _rig_of(client)
            following = _following(client, rig, specimen, executor)
            if new_baseline:
                baseline_path(rig, following.specimen).unlink(missing_ok=True)
            client.publish_twin(TwinStatus(pid=os.getpid(), state="waiting", sentence="nothing is measured"))
            console.print(f"Following {engine.what}, process {engine.pid}; Ctrl-C ends the twin.")
            while True:
                time.sleep(following.look())
        except EngineGone:
            require_ended(engine)
            console.print("The engine has ended.")
        except KeyboardInterrupt:
            console.print("The engine continues.")


def _rig_of(client: EngineClient) -> Rig:
    while True:
        try:
            return client.open_rig()
        except EngineGone:
            raise
        except AcquisitionError:  # the bench is still being opened
            time.sleep(IDLE_S)


def _following(
    client: EngineClient, rig: Rig, specimen: str | None, executor: ThreadPoolExecutor
) -> _Following:
    status = client.status()
    if status.bench is None:
        raise EngineError("the bench was closed before the twin could read it; start the twin again")
    roles = [each.role.value for each in rig.daq.channels]
    known_as = specimen_of(rig) if specimen is None else read_specimen(specimen).specimen()
    baseline = kept_baseline(baseline_path(rig, known_as))
    live = LiveTwin(
        rig,
        status.bench.sample_rate_hz,
        executor,
        known_as,
        None if baseline is None else dict(baseline.numbers),
    )
    live.warm_up()
    rows = (roles.index("base_acceleration"), roles.index("m0_velocity"))
    return _Following(client, rig, known_as, live, rows)
