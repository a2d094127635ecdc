"""Fault scripts: each fault begins at its rig time, ends after its duration, and has its effect."""

from pathlib import Path

import numpy as np
import pytest

from tests.changed import changed
from tests.small_rig import small_rig
from vibench.acquisition import ConfigurationError, InstrumentError, InstrumentLost, open_bench
from vibench.acquisition.bench import RigPower
from vibench.acquisition.campaign import ReconnectingBench
from vibench.acquisition.errors import DataLost, InstrumentBusy
from vibench.acquisition.recording._disk import meet_trouble
from vibench.acquisition.rig import load_rig, with_faults
from vibench.virtual_rig import DiskFaults, VirtualRig, load_fault_script
from vibench.virtual_rig.rig import DISK_FAULTS, PlayedFault
from vibench.virtual_rig.world.conversion import Coupling, Input

ROOT = Path(__file__).parents[3]
NIGHT = ROOT / "hardware_configs" / "faults" / "night.toml"
STEP_S = 1 / 102_400


@pytest.fixture
def rig():
    return small_rig()


@pytest.fixture
def scripted(rig, tmp_path):
    def make(text, **changes):
        path = tmp_path / "faults.toml"
        path.write_text(text, encoding="utf-8")
        return with_faults(changed(rig, virtual=changes), path)

    return make


def fault(name, at_s, **parameters):
    lines = [f"{key} = {value!r}".replace("'", '"') for key, value in parameters.items()]
    return "\n".join(["[[faults]]", f"at_s = {at_s}", f'fault = "{name}"', *lines, ""])


def read_for(bench, duration_s):
    """Read blocks of 0.1 s, as a run does."""
    rate_hz = bench.digitizer.sample_rate_hz
    for _ in range(round(duration_s / 0.1)):
        bench.digitizer.read(round(0.1 * rate_hz))


class TestScripts:
    def test_the_shipped_night_script_has_20_faults_that_end_within_8_hours(self):
        faults = load_fault_script(NIGHT).faults
        assert len(faults) == 20
        assert max(each.at_s + (each.for_s or 0.0) for each in faults) < 8 * 3600
        kinds = {each.fault for each in faults}
        asked_for = {
            "pull_usb_cable", "overrun", "reserve_device", "lose_daq_server", "jump_clock", "drop_laser",
            "over_range", "stick_output", "fill_disk", "slow_disk",
        }  # fmt: skip
        assert asked_for <= kinds

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            (fault("pull_the_plug", 1), "pull_the_plug.*pull_usb_cable"),
            (fault("drop_laser", 1), "for_s is missing"),
            (fault("jump_clock", 1, by_ms=3), "by_ms is not a known key .did you mean by_s"),
            (fault("overrun", -1), r"at_s = -1"),
        ],
    )
    def test_the_refusal_of_an_invalid_fault_names_the_fault(self, tmp_path, text, said):
        path = tmp_path / "faults.toml"
        path.write_text(text, encoding="utf-8")
        with pytest.raises(ConfigurationError, match=rf"faults\.toml.*{said}"):
            load_fault_script(path)

    def test_a_fault_script_path_is_relative_to_the_folder_of_its_configuration(self, tmp_path):
        (tmp_path / "bad.toml").write_text(fault("overrun", 1), encoding="utf-8")
        text = (ROOT / "hardware_configs" / "virtual_rig.toml").read_text(encoding="utf-8")
        (tmp_path / "rig.toml").write_text(text + '\nfaults = "bad.toml"\n', encoding="utf-8")
        assert Path(load_rig(tmp_path / "rig.toml").virtual.faults) == tmp_path / "bad.toml"

    def test_a_fault_script_is_refused_for_a_real_rig(self, rig):
        with pytest.raises(ConfigurationError, match="is a real rig"):
            with_faults(rig.model_copy(update={"virtual": None}), NIGHT)

    @pytest.mark.parametrize("name", sorted(DISK_FAULTS))
    def test_a_rig_served_to_other_programs_refuses_disk_faults(self, scripted, name):
        text = fault(name, 1, **({"delay_s": 0.1} if name == "slow_disk" else {}))
        with pytest.raises(ConfigurationError, match="need a program that records"):
            VirtualRig(scripted(text), disk=DiskFaults.REFUSED)


class TestTime:
    def test_every_fault_begins_at_its_time_for_any_block_size(self, scripted):
        text = fault("corrupt_reply", 0.12345) + fault("over_range", 0.5, for_s=0.1)
        shown = []
        for piece_s in (0.05, 0.7):
            with VirtualRig(scripted(text)) as virtual:
                sampler = virtual.world.sample((Input("cDAQ1Mod1/ai3", 5.0, Coupling.DC),), 51_200)
                count = round(piece_s * 51_200)
                parts = [sampler.read(count)[0] for _ in range(round(0.7 / piece_s))]
                shown.append(np.concatenate(parts))
                assert virtual.played_faults == (
                    PlayedFault("corrupt_reply", pytest.approx(0.12345, abs=STEP_S)),
                    PlayedFault("over_range", pytest.approx(0.5, abs=STEP_S)),
                )
        np.testing.assert_array_equal(*shown)
        full = np.flatnonzero(shown[0] > 3.9) / 51_200
        assert (full[0], full[-1]) == pytest.approx((0.5, 0.6), abs=2e-3)

    def test_a_rig_in_real_time_also_runs_its_fault_script(self, scripted):
        text = fault("overrun", 0.3)
        with open_bench(scripted(text, pace="wall", speed=3.0)) as bench:
            bench.digitizer.start()
            with pytest.raises(DataLost):
                read_for(bench, 2.0)

    def test_a_virtual_rig_continues_while_its_bench_is_closed_and_opened_again(self, scripted):
        with RigPower(scripted(fault("corrupt_reply", 1.0))) as power:
            for _ in range(3):
                with open_bench(power.rig, power=power) as bench:
                    bench.digitizer.start()
                    read_for(bench, 0.5)
                    bench.digitizer.stop()
            assert [each.fault for each in power.played_faults] == ["corrupt_reply"]


class TestEffects:
    @pytest.mark.parametrize(
        ("name", "parameters", "error"),
        [
            ("overrun", {}, DataLost),
            ("lose_daq_server", {}, InstrumentLost),
            ("fail_daq", {"call": "ReadAnalogF64", "code": -200361}, DataLost),
        ],
    )
    def test_a_converter_fault_stops_its_reader_and_ends_on_time(self, scripted, name, parameters, error):
        with ReconnectingBench(scripted(fault(name, 0.5, for_s=0.4, **parameters))) as kept:
            kept.bench.digitizer.start()
            with pytest.raises(error):
                read_for(kept.bench, 1.0)
            kept.reopen()  # after another second of rig time
            kept.bench.digitizer.start()
            read_for(kept.bench, 0.5)

    def test_a_fault_ends_in_time_during_continuous_retries(self, scripted):
        with open_bench(scripted(fault("overrun", 0.1, for_s=2.0))) as bench:
            failures = 0
            for _ in range(10):
                bench.digitizer.start()
                try:
                    read_for(bench, 0.3)
                except DataLost:
                    failures += 1
                bench.digitizer.stop()
        # The first retry fails at once; rig time advances only by half a second in each further retry.
        assert failures == 5

    def test_a_fault_of_a_full_disk_ends_during_retries(self, scripted):
        with RigPower(scripted(fault("fill_disk", 0.1, for_s=2.5))) as power:
            power.let_pass(0.2)
            refusals = 0
            for _ in range(10):
                try:
                    meet_trouble()
                except OSError:
                    refusals += 1
            assert refusals == 4  # the first refusal at once, then one per second of rig time

    def test_a_device_used_by_another_program_is_reported_until_it_is_released(self, scripted):
        with ReconnectingBench(scripted(fault("reserve_device", 0.2, for_s=1.5))) as kept:
            kept.bench.digitizer.start()
            read_for(kept.bench, 0.5)  # a running task continues
            with pytest.raises(InstrumentBusy, match="another program"):
                kept.reopen()
            kept.reopen()

    @pytest.mark.parametrize(
        ("name", "said"), [("pull_usb_cable", "amplifier"), ("hang_generator", "MAY STILL BE ON")]
    )
    def test_a_lost_generator_is_detected_at_the_next_command_and_can_be_reopened(self, scripted, name, said):
        with ReconnectingBench(scripted(fault(name, 0.2, for_s=1.5))) as kept:
            kept.bench.digitizer.start()
            read_for(kept.bench, 0.3)
            with pytest.raises(InstrumentError, match=said):
                kept.bench.generator.set_amplitude(0.1)
            with pytest.raises(InstrumentError):
                kept.reopen()
            kept.reopen()
            kept.bench.generator.set_amplitude(0.1)

    def test_a_clock_jump_of_a_quarter_period_shifts_the_phase_by_90_degrees(self, scripted):
        with open_bench(scripted(fault("jump_clock", 1.0, by_s=0.0025))) as bench:
            bench.generator.load_sine(100.0, 1.0)
            bench.generator.start()
            bench.digitizer.start()
            volts = bench.digitizer.read(2 * 5120).volts[0]
        time_s = np.arange(5120) / 5120
        turned = np.exp(-2j * np.pi * 100.0 * time_s)
        middle = slice(512, 4608)
        before, after = (np.angle(np.sum((part * turned)[middle])) for part in (volts[:5120], volts[5120:]))
        assert (after - before) % (2 * np.pi) == pytest.approx(np.pi / 2, abs=0.02)

    def test_a_turned_gain_knob_is_turned_back_after_the_fault(self, scripted):
        with VirtualRig(scripted(fault("turn_amplifier_gain", 0.1, gain_db=20, for_s=0.1))) as virtual:
            gains = []
            for _ in range(3):
                gains.append(virtual.world.plant.gain)
                virtual.world.advance(0.11)
            assert gains == pytest.approx([10**0.5, 10.0, 10**0.5])

    def test_a_disconnected_cable_is_reconnected_after_the_fault(self, scripted):
        text = fault("disconnect", 0.3, channel="cDAQ1Mod1/ai0", for_s=0.3)
        with open_bench(scripted(text)) as bench:
            bench.generator.load_sine(100.0, 1.0)
            bench.generator.start()
            bench.digitizer.start()
            heard = [np.std(bench.digitizer.read(512).volts[0]) > 0.05 for _ in range(10)]
        assert heard == [True] * 3 + [False] * 3 + [True] * 4
