"""Check of a whole bench in silence, with a small sine, and in silence again."""

import shutil
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from ..bench import Bench, BenchReport, Bounds, Finding, Verdict, finding_of
from ..errors import CheckStopped, ConfigurationError, DataLost, RunStalled
from ..excitation.dwell import Dwell
from ..excitation.steps import Tone
from ..instruments import AnalogOutput, IdleOutput, Samples, read_block
from ..plan import CHECK_FREQUENCY_HZ, DriveSource, Measurement, Phase, RunState, check_amplitude_vpp
from ..rig import Channel, calibrations
from ..run.acquisition_loop import BLOCK_S
from ..run.drive import Drive, drive_for
from ..run.silence_watch import DriveGuard
from ..stopping.stop import Cause, StopSwitch
from .loop import LoopCheck

CHECK_SHARE = 0.02
"""Largest level of the test sine as a fraction of the bench's amplitude limit, far below clipping."""
# After this time, the step response of an AC coupling with a corner frequency of 0.5 Hz has decayed.
_SETTLE_S = 1.5
_READ_S = 2.0
_BYTES_PER_SAMPLE = 4
_SECONDS_PER_HOUR = 3600.0
NOISE_SHARE = Bounds(1e-3, 2e-2)
"""Bounds on the rms of a channel in silence, relative to its full scale."""
_MEDIAN_OF_NORMAL = 0.6745
"""Ratio of median magnitude to standard deviation of a normal variable."""
_IN_MOMENTS = 0.2
"""Smallest ratio of the rms estimated from the median to the total rms; bursts make the ratio smaller."""
OFFSET_SHARE = Bounds(1e-2, 1e-1)
"""Bounds on the mean of a channel in silence, relative to its full scale."""
LATENCY_S = Bounds(0.5, 5.0)
"""Bounds on the time to change and verify one generator setting [s]; a stop takes the same time."""
ROOM_H = Bounds(-10.0, -1.0)
"""Bounds on the recording time for which the disk has space [h]; negated, because a longer time is better."""


def bench_report(
    bench: Bench, folder: Path, switch: StopSwitch | None = None, amplitude_vpp: float | None = None
) -> BenchReport:
    """Check a bench before measurements and return the findings; the generator is silent afterwards.

    All channels are read in silence, during a small sine at 160 Hz for some seconds, and in silence again.
    ``bench`` must not be sampling; ``folder`` is for the recordings; another thread can stop the check with
    ``switch``, within a block of samples. The default of ``amplitude_vpp`` [V] is at most 2 % of the
    amplitude limit, and causes no contact.

    Raises CheckStopped when somebody stopped the check, InstrumentError when an instrument fails, DataLost
    when the converter lost samples, and ConfigurationError when the bench plays a recording back. All other
    faults become findings.
    """
    if bench.rig.plays_back:
        raise ConfigurationError(
            f"the bench {bench.rig.name!r} plays back a recording, so there is nothing to check. Measure "
            "with the plan of that recording"
        )
    findings = [
        Finding(name=part, value=identity.reply, expected="an answer", verdict=Verdict.OK)
        for part, identity in bench.identities.items()
    ]
    findings += [*_calibrations(bench), _disk_finding(bench, folder)]
    if amplitude_vpp is None:
        amplitude_vpp = check_amplitude_vpp(CHECK_SHARE * bench.rig.generator.amplitude_limit_vpp, bench.rig)
    sine = Dwell(
        amplitude_vpp=amplitude_vpp,
        frequency_hz=CHECK_FREQUENCY_HZ,
        settle_s=_SETTLE_S,
        duration_s=_READ_S,
    )
    drive = drive_for(bench, Measurement(name="check", excitation=sine))
    reader = _BlockReader(bench, StopSwitch() if switch is None else switch)
    bench.generator.stop()
    quiet = reader.in_silence()
    during = reader.during_sine(drive)
    after = reader.in_silence()
    if drive.drive_source is DriveSource.GENERATOR:
        bench.generator.set_amplitude(bench.generator.amplitude_range_vpp[0])  # the relay may be stuck
        findings.append(_latency(bench))
    if bench.output is not None:
        findings.append(_idle_finding(bench.output))
    for channel, row in zip(bench.channels, quiet, strict=True):
        findings += [_noise(channel, row), _offset(channel, row)]
    findings += LoopCheck(bench, amplitude_vpp, during, after).findings()
    return BenchReport(findings=tuple(findings))


class _BlockReader:
    """Reader that takes samples from a bench in blocks; the check can be stopped between two blocks."""

    def __init__(self, bench: Bench, switch: StopSwitch) -> None:
        self._bench = bench
        self._switch = switch
        self._due = 0
        self._advance: Callable[[], None] = lambda: None

    def in_silence(self) -> Samples:
        """Return samples of all channels while nothing plays, after the AC couplings have settled."""
        self._begin()
        try:
            self._read_for(_SETTLE_S)
            return np.concatenate(self._read_for(_READ_S), axis=1)
        finally:
            self._bench.digitizer.stop()

    def during_sine(self, drive: Drive) -> Samples:
        """Play the sine without a ramp, as the check before a run does; return the settled samples."""
        tone = Tone(CHECK_FREQUENCY_HZ)
        settling = Phase(RunState.CHECKING, tone, _SETTLE_S)
        measuring = Phase(RunState.CHECKING, tone, _READ_S)
        with DriveGuard(drive, self._switch) as guard:
            self._advance = guard.advance
            guard.begin(self._bench.rig.generator.resource or self._bench.rig.daq.device)
            try:
                drive.arm((settling, measuring))
                self._begin()
                for wait_s in drive.perform(settling):
                    self._read_for(wait_s)
                blocks = [block for wait_s in drive.perform(measuring) for block in self._read_for(wait_s)]
                return np.concatenate(blocks, axis=1)
            except BaseException:
                guard.silence()  # the call below also lowers the amplitude, which helps if the relay is stuck
                raise
            finally:
                try:
                    guard.silence()
                finally:
                    self._bench.digitizer.stop()

    def _begin(self) -> None:
        self._bench.digitizer.start()
        self._due = 0

    def _read_for(self, duration_s: float) -> list[Samples]:
        digitizer = self._bench.digitizer
        rate_hz = digitizer.sample_rate_hz
        left, longest = round(duration_s * rate_hz), round(BLOCK_S * rate_hz)
        blocks = []
        while left > 0:
            if (request := self._switch.request) is not None:
                if request.cause is Cause.FAULT:
                    raise RunStalled(request.reason)
                raise CheckStopped(
                    f"the bench check was stopped: {request.reason}. The output is off; check the bench again"
                )
            block = read_block(digitizer, min(longest, left))
            self._advance()
            if block.first_sample != self._due:
                raise DataLost(
                    f"the converter returned sample {block.first_sample} instead of {self._due}: the "
                    "converter loses samples although no other program uses it. Look for other bus traffic"
                )
            self._due += block.volts.shape[1]
            blocks.append(block.volts)
            left -= block.volts.shape[1]
        return blocks


def _calibrations(bench: Bench) -> list[Finding]:
    today = datetime.now(UTC).astimezone().date()
    return [
        Finding(
            name=f"calibration of {one.what}",
            value=f"{one.calibrated}",
            expected=f"at most {one.valid_days} days ago",
            verdict=Verdict.OK if one.is_valid else Verdict.WARN,
            number=one.age_days,
            unit="d",
            advice="" if one.is_valid else one.advice,
        )
        for one in calibrations(bench.rig, today)
    ]


def _disk_finding(bench: Bench, folder: Path) -> Finding:
    bytes_per_s = bench.digitizer.sample_rate_hz * len(bench.channels) * _BYTES_PER_SAMPLE
    there = next(each for each in (folder, *folder.resolve().parents) if each.exists())
    hours = shutil.disk_usage(there).free / bytes_per_s / _SECONDS_PER_HOUR
    return finding_of(
        "free space on the disk",
        hours,
        "h",
        f"{-ROOM_H.well:g} h or more",
        ROOM_H.verdict(-hours),
        "make room, or record elsewhere",
    )


def _idle_finding(output: AnalogOutput) -> Finding:
    is_zero = output.idle is IdleOutput.ZERO
    advice = "if the program crashes, the output holds its last value: keep the gain knob within reach"
    return Finding(
        name="output without a program",
        value=output.idle.value,
        expected=IdleOutput.ZERO.value,
        verdict=Verdict.OK if is_zero else Verdict.WARN,
        advice="" if is_zero else advice,
    )


def _latency(bench: Bench) -> Finding:
    latency_s = bench.generator.measured_latency_s()
    verdict = LATENCY_S.verdict(latency_s)
    advice = "shorten generator.settle_s, or reduce other bus traffic: a stop takes as long as this command"
    return finding_of("time per command", latency_s, "s", f"{LATENCY_S.well:g} s or less", verdict, advice)


def _noise(channel: Channel, row: Samples) -> Finding:
    rms_v = float(np.std(row))
    verdict = NOISE_SHARE.verdict(rms_v / channel.full_scale_v)
    advice = "look for mains hum, a loose shield, or a cable that picks up interference"
    usual_v = float(np.median(np.abs(row - np.median(row)))) / _MEDIAN_OF_NORMAL
    if usual_v < _IN_MOMENTS * rms_v:
        advice = (
            f"the noise comes in bursts, with {usual_v:.2g} V between them: look for a loose contact, or a "
            "laser that loses its signal; refocus the laser, or apply reflective tape"
        )
    if rms_v == 0.0:
        verdict, advice = (
            Verdict.FAIL,
            "a working input always has some noise: check that this input is sampled",
        )
    expected = f"{NOISE_SHARE.well * channel.full_scale_v:.3g} V or less"
    return finding_of(f"noise of {channel.role.value}", rms_v, "V", expected, verdict, advice)


def _offset(channel: Channel, row: Samples) -> Finding:
    mean_v = float(np.mean(row))
    verdict = OFFSET_SHARE.verdict(abs(mean_v) / channel.full_scale_v)
    advice = "look for an open input, a sensor's bias voltage with DC coupling, or an off-centre shaker"
    expected = f"0 ± {OFFSET_SHARE.well * channel.full_scale_v:.3g} V"
    return finding_of(f"offset of {channel.role.value}", mean_v, "V", expected, verdict, advice)
