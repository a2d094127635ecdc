"""The bench check: a healthy bench passes, every fault is found, and the output ends silent."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from vibench.acquisition import BenchReport, InstrumentLost, StopSwitch, Verdict, open_bench
from vibench.acquisition.bench import Bounds
from vibench.acquisition.check.bench_report import bench_report
from vibench.acquisition.check.loop import clock_ratio
from vibench.acquisition.errors import CheckStopped, InstrumentError, RunStalled
from vibench.acquisition.rig import load_rig
from vibench.acquisition.run.silence_watch import fit_sine
from vibench.acquisition.stopping.stop import Cause, StopRequest
from vibench.virtual_rig.generator.scpi_instrument import Quirks

from ..run.ending_silent import terminal_v

SILENT_V = 5e-3


@pytest.fixture
def check_rig(bench_of):
    def check(rig, tmp_path, fault=lambda virtual: None, **habits):
        with bench_of(rig, **habits) as (bench, virtual):
            fault(virtual)
            report = bench_report(bench, tmp_path)
            assert virtual.generator.execute(b"OUTP1?").data == b"0\n"
        return report

    return check


def failed_findings(report):
    return {finding.name for finding in report.findings if finding.verdict is Verdict.FAIL}


def test_a_healthy_bench_passes_its_check_and_matches_its_configuration(check_rig, rig, tmp_path):
    report = check_rig(rig, tmp_path)
    assert failed_findings(report) == set()
    clock = report["drive's clock"]
    told_ppm = rig.virtual.generator_clock_ppm - rig.virtual.converter_clock_ppm
    assert abs(clock.number - told_ppm) < 5 * clock.uncertainty + 0.01
    assert report["amplifier gain"].number == pytest.approx(rig.amplifier.gain_db, abs=0.05)
    assert report["drive over setting"].number == pytest.approx(1.0, abs=2e-3)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("masses_kg", "stiffnesses_n_per_m", "dampings_ns_per_m", "gap_m"),
    [
        ((4.076e-3, 2.409e-3, 1.830e-3), (16538.6, 453.8, 7581.2), (0.386, 0.0096, 0.148), (12.2e-6, 41e-6)),
        ((6.092e-3, 2.690e-3, 2.106e-3), (14489.5, 462.2, 17626.2), (0.349, 0.0105, 0.179), (16.2e-6, 48e-6)),
        ((9.585e-3, 1.350e-3, 3.375e-3), (14452.5, 645.7, 10895.4), (0.888, 0.0143, 0.191), (11.8e-6, 22e-6)),
        ((10.04e-3, 1.134e-3, 2.805e-3), (12976.7, 425.9, 20127.5), (0.276, 0.0094, 0.371), (26.4e-6, 32e-6)),
    ],
)
def test_a_heavy_specimen_near_its_resonance_is_not_reported_as_a_fault(
    rig, tmp_path, check_rig, masses_kg, stiffnesses_n_per_m, dampings_ns_per_m, gap_m
):
    own = {
        "masses_kg": masses_kg,
        "single_frequencies_hz": None,
        "stiffnesses_n_per_m": stiffnesses_n_per_m,
        "damping_time_s": None,
        "dampings_ns_per_m": dampings_ns_per_m,
        "gap_m": gap_m,
    }
    heavy = rig.model_copy(update={"specimen": rig.specimen.model_copy(update=own)})
    report = check_rig(heavy, tmp_path)
    assert failed_findings(report) == set()
    assert report["base acceleration"].verdict is Verdict.OK
    for role in ("base_acceleration", "m0_velocity"):
        assert report[f"sign of {role}"].verdict is Verdict.OK


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("fault", "name", "advice"),
    [
        (lambda v: v.faults.turn_amplifier_gain(20.0), "amplifier gain", "set the gain"),
        (lambda v: v.faults.turn_amplifier_gain(20.0), "base acceleration", "gain"),
        (lambda v: v.faults.drop_laser(60.0), "m0_velocity detects the sine", "laser"),
        (
            lambda v: v.faults.disconnect("cDAQ1Mod1/ai2"),
            "base_acceleration detects the sine",
            "accelerometer",
        ),
        (lambda v: v.faults.disconnect("cDAQ1Mod1/ai1"), "amplifier_voltage detects the sine", "cable"),
        (lambda v: v.faults.disconnect("cDAQ1Mod1/ai0"), "drive over setting", "cable"),
        (lambda v: v.faults.over_range(60.0), "offset of m0_velocity", "bias"),
        (lambda v: v.faults.reverse("cDAQ1Mod1/ai2"), "sign of base_acceleration", "reverse the acceler"),
        (lambda v: v.faults.reverse("cDAQ1Mod1/ai1"), "sign of amplifier_voltage", "two wires"),
        (lambda v: v.faults.stick_output(), "drive left after stop", "switch the amplifier off"),
    ],
)
def test_each_bench_fault_gives_a_failed_finding_with_advice(check_rig, rig, tmp_path, fault, name, advice):
    report = check_rig(rig, tmp_path, fault)
    assert name in failed_findings(report)
    assert advice in report[name].advice
    assert report.verdict is Verdict.FAIL


@pytest.mark.thorough
def test_a_laser_drop_out_is_distinguished_from_hum(check_rig, rig, tmp_path):
    virtual = rig.virtual.model_copy(update={"vibrometer_dropouts_per_s": 10.0})
    dark = check_rig(rig.model_copy(update={"virtual": virtual}), tmp_path)["noise of m0_velocity"]
    assert dark.verdict is not Verdict.OK
    assert "a laser that loses its signal" in dark.advice
    virtual = rig.virtual.model_copy(update={"vibrometer_noise_m_per_s_per_rthz": 1e-3})
    loud = check_rig(rig.model_copy(update={"virtual": virtual}), tmp_path)["noise of m0_velocity"]
    assert "look for mains hum" in loud.advice


@pytest.mark.thorough
def test_a_vibrometer_with_a_reversed_sign_gives_a_warning(check_rig, rig, tmp_path):
    assert check_rig(rig, tmp_path)["sign of m0_velocity"].verdict is Verdict.OK
    report = check_rig(rig, tmp_path, lambda v: v.faults.reverse("cDAQ1Mod1/ai3"))
    assert report["sign of m0_velocity"].verdict is Verdict.WARN
    assert "this sensor is reversed" in report["sign of m0_velocity"].advice
    assert failed_findings(report) == set()


class StopWhenOutputIsOn(StopSwitch):
    """Requests a stop when the generator's output is on."""

    def __init__(self, generator):
        super().__init__()
        self.generator = generator

    @property
    def request(self):
        if self.generator.execute(b"OUTP1?").data == b"1\n":
            self.ask(StopRequest.of(Cause.TERMINATED, "SIGTERM"))
        return super().request


@pytest.mark.parametrize("is_stuck", [False, True])
def test_a_stop_during_a_check_silences_the_drive(bench_of, rig, tmp_path, is_stuck):
    with bench_of(rig) as (bench, virtual):
        if is_stuck:
            virtual.faults.stick_output()
        switch = StopWhenOutputIsOn(virtual.generator)
        with pytest.raises(CheckStopped, match=r"was stopped: SIGTERM\. The output is off"):
            bench_report(bench, tmp_path, switch)
        assert virtual.generator.execute(b"OUTP1?").data == b"0\n"
        assert terminal_v(virtual) < SILENT_V


class StallWhenOutputIsOn(StopWhenOutputIsOn):
    """Requests a stop like the drive guard of a stalled run."""

    def ask(self, request):
        super().ask(StopRequest.of(Cause.FAULT, "the run read no samples for 5 s"))


def test_a_stalled_check_counts_as_failed_and_not_as_stopped(bench_of, rig, tmp_path):
    with bench_of(rig) as (bench, virtual), pytest.raises(RunStalled, match="no samples for 5 s"):
        bench_report(bench, tmp_path, StallWhenOutputIsOn(virtual.generator))


def test_a_converter_without_samples_ends_the_check_with_the_output_off(bench_of, rig, tmp_path, monkeypatch):
    with bench_of(rig) as (bench, virtual):
        read, blocks = type(bench.digitizer).read, iter(range(100))

        def empty_from_third_read(digitizer, samples):
            block = read(digitizer, samples)
            return replace(block, volts=block.volts[:, :0]) if next(blocks) > 2 else block

        monkeypatch.setattr(type(bench.digitizer), "read", empty_from_third_read)
        with pytest.raises(InstrumentError, match=r"a block of shape \(4, 0\), but \d+ samples"):
            bench_report(bench, tmp_path)
        assert virtual.generator.execute(b"OUTP1?").data == b"0\n"


@pytest.mark.thorough
def test_a_wrong_load_setting_that_cannot_be_read_is_found_and_explained(check_rig, rig, tmp_path):
    assert failed_findings(check_rig(rig, tmp_path, quirks=Quirks(panel_load_ohm=inf))) == set()
    # The panel is set to 50 ohm: every amplitude is twice the setting.
    report = check_rig(rig, tmp_path, quirks=Quirks(panel_load_ohm=50.0))
    assert report["drive over setting"].number == pytest.approx(2.0, rel=2e-2)
    assert "a factor of 2 means a wrong load" in report["drive over setting"].advice


def test_a_lost_generator_raises_an_error(bench_of, rig, tmp_path):
    with bench_of(rig) as (bench, virtual):
        virtual.faults.pull_usb_cable()
        with pytest.raises(InstrumentLost):
            bench_report(bench, tmp_path)
        virtual.faults.heal()


@pytest.mark.thorough
def test_the_bench_report_is_a_table_and_round_trips_through_json(check_rig, rig, tmp_path):
    report = check_rig(rig, tmp_path, lambda virtual: virtual.faults.turn_amplifier_gain(20.0))
    assert BenchReport.model_validate_json(report.model_dump_json()) == report
    lines = report.text().splitlines()
    at = next(index for index, line in enumerate(lines) if "amplifier gain" in line)
    assert lines[at].startswith("FAIL")
    assert lines[at + 1].strip().startswith("-> set the gain")
    with pytest.raises(KeyError, match=r"amplifier gain"):
        report["nonsense"]


@pytest.mark.thorough
def test_a_bench_with_an_analogue_output_for_sines_is_checked_through_that_output(tmp_path):
    rig = load_rig("virtual_rig_streaming")
    with open_bench(rig) as bench:
        report = bench_report(bench, tmp_path)
    assert failed_findings(report) == set()
    assert report["drive over setting"].number == pytest.approx(1.0, abs=2e-3)
    # The output uses the converter's clock; the generator's clock would be 17 ppm off.
    assert abs(report["drive's clock"].number) < 5 * report["drive's clock"].uncertainty + 0.01
    assert "time per command" not in [finding.name for finding in report.findings]


@pytest.mark.parametrize(
    ("deviation", "verdict"),
    [
        (1.0, Verdict.OK),
        (1.1, Verdict.WARN),
        (3.0, Verdict.WARN),
        (3.1, Verdict.FAIL),
        (np.nan, Verdict.FAIL),
    ],
)
def test_the_verdict_on_a_deviation_follows_from_its_bounds(deviation, verdict):
    assert Bounds(1.0, 3.0).verdict(deviation) is verdict


class TestSineFit:
    def test_the_amplitude_and_the_phase_of_a_pure_sine_are_exact(self):
        time_s = np.arange(1000) / 5000.0
        fit = fit_sine(0.3 + 2.0 * np.cos(2 * np.pi * 160.0 * time_s + 0.7), 160.0, 5000.0)
        assert (fit.amplitude, fit.phase_rad) == pytest.approx((2.0, 0.7), rel=1e-12)
        assert fit.uncertainty * np.sqrt(time_s.size / 2) < 1e-12

    def test_the_stated_uncertainty_matches_the_scatter_in_noise(self):
        rng = np.random.default_rng(7)
        sine = np.sin(2 * np.pi * 160.0 * np.arange(1000) / 5000.0)
        fits = [fit_sine(sine + 0.1 * rng.standard_normal(1000), 160.0, 5000.0) for _ in range(400)]
        scatter = np.std([fit.amplitude for fit in fits])
        assert scatter == pytest.approx(np.mean([fit.uncertainty for fit in fits]), rel=0.15)

    @pytest.mark.parametrize("ppm", [-60.0, 0.0, 17.0])
    def test_the_clock_ratio_is_found_within_its_uncertainty(self, ppm):
        rng = np.random.default_rng(11)
        time_s = np.arange(100_000) / 51_200.0
        sine = np.sin(2 * np.pi * 160.0 * (1 + ppm * 1e-6) * time_s + 3.0)
        found = clock_ratio(sine + 1e-3 * rng.standard_normal(time_s.size), 160.0, 51_200.0)
        assert abs(found.ppm - ppm) < 4 * found.uncertainty_ppm
        assert found.uncertainty_ppm < 1.0
