"""Opening a bench opens all instruments or none; leaving it always silences the generator."""

from contextlib import contextmanager
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from tests.changed import changed
from tests.small_rig import small_rig
from vibench.acquisition import CheckFailed, InstrumentLost, open_bench
from vibench.acquisition.bench import BenchKind
from vibench.acquisition.errors import DataLost, InstrumentBusy
from vibench.acquisition.rig import (
    CalibrationRule,
    calibrations,
    check_calibrations,
    confirm_by_sheet,
    confirm_simulated,
    save_knob_sheet,
)
from vibench.acquisition.rig._knobs import confirm_by_asking
from vibench.virtual_rig import VirtualRig
from vibench.virtual_rig.generator.scpi_instrument import Quirks


@pytest.fixture
def rig():
    return small_rig()


@pytest.fixture
def virtual(rig):
    with VirtualRig(rig) as running:
        yield running


@pytest.fixture
def laboratory(rig, virtual):
    """Return the same rig as a real one: instruments at addresses, no mention of a simulation."""
    return changed(rig, virtual=None, daq={"server": virtual.daq_address})


@contextmanager
def laboratory_bench(laboratory):
    with open_bench(laboratory, confirm_simulated, CalibrationRule.WAIVED) as bench:
        bench.generator.load_sine(160.0, 0.1)
        bench.generator.start()
        bench.digitizer.start()
        yield bench


def read_after_faults(laboratory, *faults):
    with laboratory_bench(laboratory) as bench:
        for fault in faults:
            fault()
        bench.digitizer.read(512)


def output_of(virtual):
    return virtual.generator.execute(b"OUTP1?").data


class TestOpening:
    def test_a_virtual_bench_opens_with_its_configuration_alone(self, rig):
        with open_bench(rig) as bench:
            assert bench.kind is BenchKind.SIMULATED
            assert bench.identities["generator"].model == "AFG1022"
            assert bench.identities["digitizer"].model == "NI 9234"
            assert bench.confirmations.operator == "simulated"
            assert bench.confirmations.knobs == rig.knobs
            assert [channel.role.value for channel in bench.channels] == list(bench.digitizer.roles)

    def test_the_converter_reads_the_output_of_the_generator(self, rig):
        with open_bench(rig) as bench:
            bench.generator.load_sine(160.0, 1.0)
            bench.generator.start()
            bench.digitizer.start()
            bench.digitizer.read(5120)
            drive_v = bench.digitizer.read(5120).volts[0] * bench.channels[0].units_per_volt
        assert np.std(drive_v) * np.sqrt(2) == pytest.approx(0.5 * rig.generator.terminal_factor(), rel=2e-3)

    def test_a_missing_converter_leaves_the_generator_free_and_silent(self, laboratory, virtual):
        """The output is on before the bench opens, as after a killed program."""
        virtual.generator.execute(b"OUTP1:STAT ON")
        assert output_of(virtual) == b"1\n"
        lost = changed(laboratory, daq={"server": "127.0.0.1:9"})
        with pytest.raises(InstrumentLost, match=r"127\.0\.0\.1:9"):
            open_bench(lost, confirm_simulated, CalibrationRule.WAIVED)
        assert output_of(virtual) == b"0\n"
        open_bench(laboratory, confirm_simulated, CalibrationRule.WAIVED).close()

    def test_a_missing_generator_leaves_the_converter_free(self, laboratory, virtual):
        virtual.faults.pull_usb_cable()
        with pytest.raises(InstrumentLost, match=r"no instrument answers"):
            open_bench(laboratory, confirm_simulated, CalibrationRule.WAIVED)
        virtual.faults.heal()
        open_bench(laboratory, confirm_simulated, CalibrationRule.WAIVED).close()

    def test_a_bench_with_an_unconfirmed_knob_is_refused_and_stays_silent(self, laboratory, virtual):
        with pytest.raises(CheckFailed, match=r"gain of the Bruel & Kjaer 2706 was not confirmed at 10 dB"):
            open_bench(laboratory, confirm_by_asking(lambda _: "no", "somebody"), CalibrationRule.WAIVED)
        assert output_of(virtual) == b"0\n"
        open_bench(laboratory, confirm_simulated, CalibrationRule.WAIVED).close()

    def test_a_second_bench_on_the_same_converter_is_refused_as_busy(self, laboratory):
        with laboratory_bench(laboratory), pytest.raises(InstrumentBusy):
            open_bench(laboratory, confirm_simulated, CalibrationRule.WAIVED)

    def test_the_operator_must_confirm_a_load_that_cannot_be_read(self, rig):
        asked = []

        def confirm(knobs):
            asked.extend(knobs)
            return confirm_simulated(knobs)

        with VirtualRig(rig, quirks=Quirks(panel_load_ohm=float("inf"))) as virtual:
            daq = rig.daq.model_copy(update={"server": virtual.daq_address})
            laboratory = rig.model_copy(update={"virtual": None, "daq": daq})
            open_bench(laboratory, confirm, CalibrationRule.WAIVED).close()
        assert "output load" in [knob.setting for knob in asked]


class TestLeaving:
    def test_closing_a_bench_silences_and_releases_every_instrument(self, laboratory, virtual):
        for _ in range(2):
            with laboratory_bench(laboratory):
                assert output_of(virtual) == b"1\n"
            assert output_of(virtual) == b"0\n"

    @pytest.mark.parametrize("error", [RuntimeError("mine"), KeyboardInterrupt(), SystemExit(3)])
    def test_an_exception_silences_an_open_bench_and_propagates(self, laboratory, virtual, error):
        with pytest.raises(type(error)) as caught, laboratory_bench(laboratory):
            raise error
        assert caught.value is error
        assert output_of(virtual) == b"0\n"

    def test_a_bench_whose_daq_server_died_is_silenced_and_a_failed_close_is_noted(self, laboratory, virtual):
        with pytest.raises(InstrumentLost) as caught:
            read_after_faults(laboratory, virtual.faults.lose_daq_server)
        assert str(caught.value).startswith("reading samples 0 to 511")
        assert any("releasing" in note for note in caught.value.__notes__)
        assert output_of(virtual) == b"0\n"

    def test_a_pulled_usb_cable_does_not_hide_the_first_error(self, laboratory, virtual):
        with pytest.raises(DataLost) as caught:
            read_after_faults(laboratory, virtual.faults.overrun, virtual.faults.pull_usb_cable)
        assert any("MAY STILL BE ON" in note for note in caught.value.__notes__)

    def test_the_converter_is_released_after_the_generator_was_lost(self, laboratory, virtual):
        with pytest.raises(InstrumentLost, match=r"MAY STILL BE ON"), laboratory_bench(laboratory):
            virtual.faults.pull_usb_cable()
        virtual.faults.heal()
        with laboratory_bench(laboratory):
            pass
        assert output_of(virtual) == b"0\n"


class TestCalibration:
    def test_a_bench_with_an_expired_calibration_is_refused(self, laboratory):
        with pytest.raises(
            CheckFailed, match=r"Polytec PSV-500 DV-04 was calibrated on 2001-01-01.*730 days"
        ):
            open_bench(calibrated_on(laboratory, "2001-01-01"), confirm_simulated)

    def test_an_expired_calibration_can_be_waived(self, laboratory):
        open_bench(calibrated_on(laboratory, "2001-01-01"), confirm_simulated, CalibrationRule.WAIVED).close()

    def test_a_virtual_rig_needs_no_calibration_and_may_be_closed_twice(self, rig):
        bench = open_bench(calibrated_on(rig, "2001-01-01"))
        bench.close()
        bench.close()

    @pytest.mark.parametrize(("age_days", "is_valid"), [(-1, False), (0, True), (730, True), (731, False)])
    def test_a_calibration_is_valid_for_the_number_of_days_stated_in_the_rig(self, rig, age_days, is_valid):
        today = rig.vibrometer.calibrated + timedelta(days=age_days)
        assert calibrations(rig, today)[0].is_valid is is_valid

    def test_the_calibration_of_every_sensor_and_input_is_checked(self, rig):
        today = rig.vibrometer.calibrated + timedelta(days=10_000)
        with pytest.raises(CheckFailed) as caught:
            check_calibrations(rig, today)
        for what in ("PSV-500", "IEPE", *(channel.physical for channel in rig.daq.channels)):
            assert what in str(caught.value)

    def test_a_sensor_that_no_input_uses_needs_no_calibration(self, rig):
        left = tuple(each for each in rig.daq.channels if each.role.value != "base_acceleration")
        bare = changed(rig, daq={"channels": left})
        named = [each.what for each in calibrations(bare, rig.vibrometer.calibrated)]
        assert not any("IEPE" in each for each in named)
        assert any("PSV-500" in each for each in named)


class TestKnobs:
    def test_the_operator_is_asked_once_about_every_knob(self, rig):
        asked = []
        sheet = confirm_by_asking(lambda question: asked.append(question) or "y", "B. Kjaer")(rig.knobs)
        assert len(asked) == len(rig.knobs)
        assert "2706: is the gain at 10 dB?" in asked[0]
        assert (sheet.operator, sheet.knobs) == ("B. Kjaer", rig.knobs)

    def test_a_saved_knob_sheet_confirms_the_knobs_that_it_lists(self, rig, tmp_path):
        path = tmp_path / "knobs.toml"
        sheet = confirm_by_asking(lambda _: "yes", 'O. "Quote" \\ Back\nslash')(rig.knobs)
        save_knob_sheet(sheet, path)
        assert confirm_by_sheet(path)(rig.knobs) == sheet

    def test_a_knob_sheet_whose_settings_differ_from_the_rig_is_refused(self, rig, tmp_path):
        path = tmp_path / "knobs.toml"
        save_knob_sheet(confirm_simulated(rig.knobs), path)
        turned = changed(rig, amplifier={"gain_db": 20.0})
        with pytest.raises(CheckFailed, match=r"does not confirm Bruel & Kjaer 2706 gain at 20 dB"):
            confirm_by_sheet(path)(turned.knobs)

    @pytest.mark.parametrize("age", [timedelta(hours=-1), timedelta(hours=37)])
    def test_a_knob_sheet_that_is_too_old_or_from_the_future_is_refused(self, rig, tmp_path, age):
        path = tmp_path / "knobs.toml"
        old = confirm_simulated(rig.knobs).model_copy(update={"confirmed": datetime.now(UTC) - age})
        save_knob_sheet(old, path)
        with pytest.raises(CheckFailed, match=r"it is valid for"):
            confirm_by_sheet(path)(rig.knobs)

    def test_a_real_bench_without_an_operator_is_refused_with_a_list_of_the_knobs(self, laboratory):
        # pytest runs its tests without a terminal.
        with pytest.raises(CheckFailed, match=r"no one can answer here") as caught:
            open_bench(laboratory, calibration=CalibrationRule.WAIVED)
        assert all(f"{knob.setting} at {knob.value}" in str(caught.value) for knob in laboratory.knobs)


def calibrated_on(rig, day):
    vibrometer = rig.vibrometer.model_copy(update={"calibrated": datetime.fromisoformat(day).date()})
    return rig.model_copy(update={"vibrometer": vibrometer})


def test_a_virtual_bench_opens_without_a_state_folder(rig, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path / "file"))
    with open_bench(rig) as bench:
        assert bench.kind is BenchKind.SIMULATED
