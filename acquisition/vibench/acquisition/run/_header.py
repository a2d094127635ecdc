"""What a recording says before its first sample, taken from the bench and the plan."""

from ..bench import RunBench
from ..plan import Measurement
from ..recording import ChannelHeader, Origin, RecordingHeader
from ..rig import Channel, KnobSheet


def run_header(bench: RunBench, measurement: Measurement, planned_s: float) -> RecordingHeader:
    """Describe the recording of ``planned_s`` that a run of ``measurement`` on ``bench`` is going to make."""
    rig = bench.rig
    steps = bench.digitizer.volts_per_count
    sample_rate_hz = bench.digitizer.sample_rate_hz
    return RecordingHeader(
        channels=tuple(_channel(channel, step) for channel, step in zip(bench.channels, steps, strict=True)),
        sample_rate_hz=sample_rate_hz,
        expected_samples=round(planned_s * sample_rate_hz),
        origin=Origin.REAL if rig.virtual is None else Origin.SIMULATED,
        plan_json=measurement.model_dump_json(),
        bench_json=rig.model_dump_json(),
        requested_sample_rate_hz=rig.daq.sample_rate_hz,
        instruments=bench.identities,
        confirmations=_confirmations(bench.confirmations),
        bench_check_json="{}" if bench.last_check is None else bench.last_check.model_dump_json(),
    )


def _channel(channel: Channel, volts_per_count: float | None) -> ChannelHeader:
    calibrated = channel.sensor_calibrated or channel.converter_calibrated
    return ChannelHeader(
        role=channel.role.value,
        physical_channel=channel.physical,
        quantity=channel.quantity,
        unit=channel.unit,
        physical_per_volt=channel.units_per_volt,
        range_v=channel.range_v,
        volts_per_count=volts_per_count,
        coupling=channel.coupling,
        iepe_current_a=channel.iepe_current_a,
        sensitivity=1 / channel.units_per_volt,
        sensitivity_unit=f"V/({channel.unit})",
        serial=channel.serial,
        calibration_date=calibrated.isoformat(),
        delay_s=channel.delay_s,
        long_name=f"{channel.role.value.replace('_', ' ')} ({channel.sensor})",
    )


def _confirmations(sheet: KnobSheet) -> dict[str, str]:
    knobs = {f"{knob.instrument} {knob.setting}": knob.value for knob in sheet.knobs}
    return {"operator": sheet.operator, "confirmed": sheet.confirmed.isoformat(), **knobs}
