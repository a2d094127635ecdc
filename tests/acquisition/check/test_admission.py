"""A bench is armed only after a recent, passed check of the same configuration."""

import json
from datetime import UTC, datetime, timedelta

import pytest

from vibench.acquisition import (
    BenchReport,
    CheckFailed,
    CheckResult,
    CheckRule,
    Finding,
    RecordingError,
    Verdict,
    check_bench,
    last_check,
    open_bench,
    open_recording,
    run_measurement,
)
from vibench.acquisition.bench import rig_digest
from vibench.acquisition.check.admission import archive_path, keep, require_fresh, why_not
from vibench.acquisition.plan import Dwell, Measurement

NOW = datetime(2026, 5, 4, 12, 0, tzinfo=UTC)
DWELL = Measurement(
    name="run",
    excitation=Dwell(amplitude_vpp=0.5, frequency_hz=260, settle_s=0.1, duration_s=0.2),
    ramp_s=0.3,
    ramp_step_s=0.03,
)


def store_result(rig, age_h=1.0, verdict=Verdict.OK):
    found = Finding(name="amplifier gain", value="13 dB", expected="10 dB within 1 dB", verdict=verdict)
    result = CheckResult.of(rig, BenchReport(findings=(found,)), NOW - timedelta(hours=age_h))
    keep(result)
    return result


@pytest.fixture
def real(bench_of, rig, state_folder):
    """Open a simulated bench that programs take for a real one."""
    with bench_of(rig) as (bench, virtual):
        yield bench, virtual


def test_a_real_bench_without_a_check_is_not_armed(real, tmp_path):
    bench, virtual = real
    before_s = virtual.world.time_s
    with pytest.raises(CheckFailed, match=r"checked under this user account.*bench check.*--check waived"):
        require_fresh(bench, tmp_path)
    assert virtual.world.time_s == before_s


@pytest.mark.parametrize(
    ("age_h", "verdict", "said"),
    [
        (12.1, Verdict.OK, r"is 12\.1 h old; 12 h are allowed \(check_valid_h\)"),
        (-0.1, Verdict.OK, r"is -0\.1 h old"),
        (1.0, Verdict.FAIL, "did not pass: amplifier gain is 13 dB, expected 10 dB within 1 dB"),
    ],
)
def test_a_real_bench_whose_check_failed_or_is_old_is_not_armed(real, tmp_path, age_h, verdict, said):
    bench, _ = real
    store_result(bench.rig, age_h, verdict)
    with pytest.raises(CheckFailed, match=said):
        require_fresh(bench, tmp_path, clock=lambda: NOW)


@pytest.mark.parametrize("verdict", [Verdict.OK, Verdict.WARN])
def test_a_recently_passed_check_is_not_repeated(real, tmp_path, verdict):
    bench, virtual = real
    result = store_result(bench.rig, 11.9, verdict)
    before_s = virtual.world.time_s
    assert require_fresh(bench, tmp_path, clock=lambda: NOW) == result
    assert virtual.world.time_s == before_s


def test_a_check_of_another_configuration_does_not_arm_the_bench(real, tmp_path):
    bench, _ = real
    turned = bench.rig.amplifier.model_copy(update={"gain_db": 20.0})
    store_result(bench.rig.model_copy(update={"amplifier": turned}))
    with pytest.raises(CheckFailed, match="was made with another configuration"):
        require_fresh(bench, tmp_path, clock=lambda: NOW)


def test_the_rig_sets_how_long_a_check_is_valid(rig, state_folder):
    patient = rig.model_copy(update={"check_valid_h": 48.0})
    result = store_result(rig, 30.0)
    assert "12 h are allowed" in why_not(result, rig, NOW)
    assert why_not(result, patient, NOW) is None


@pytest.mark.thorough
def test_a_new_check_arms_the_bench_and_is_recorded(real, tmp_path):
    bench, _ = real
    result = require_fresh(bench, tmp_path, CheckRule.NOW)
    assert result == last_check(bench.rig.name)
    run_measurement(bench, DWELL, tmp_path / "run.h5")
    with open_recording(tmp_path / "run.h5") as recording:
        assert recording.bench_check == json.loads(result.model_dump_json())
        assert recording.bench_check["verdict"] in ("ok", "warn")


def test_a_failed_new_check_is_stored_and_does_not_arm_the_bench(real, tmp_path):
    bench, virtual = real
    virtual.faults.turn_amplifier_gain(20.0)
    with pytest.raises(
        CheckFailed, match=r"did not pass its check.*amplifier gain is 20 .*The output is off; "
    ):
        require_fresh(bench, tmp_path, CheckRule.NOW)
    assert last_check(bench.rig.name).verdict is Verdict.FAIL
    with pytest.raises(CheckFailed, match="did not pass"):
        require_fresh(bench, tmp_path)


@pytest.mark.thorough
def test_a_check_warns_about_the_output_if_the_drive_stays_on_afterwards(real, tmp_path):
    bench, virtual = real
    virtual.faults.stick_output()
    with pytest.raises(
        CheckFailed, match=r"drive left after stop.*THE OUTPUT MAY STILL BE ON: switch the amp"
    ):
        require_fresh(bench, tmp_path, CheckRule.NOW)


def test_a_waived_check_is_noted_in_the_recording(real, tmp_path):
    bench, _ = real
    assert require_fresh(bench, tmp_path, CheckRule.WAIVED) is None
    run_measurement(bench, DWELL, tmp_path / "run.h5")
    with open_recording(tmp_path / "run.h5") as recording:
        assert recording.bench_check == {}


@pytest.mark.thorough
def test_a_virtual_bench_is_checked_once_automatically(rig, state_folder, tmp_path):
    with open_bench(rig) as bench:
        first = require_fresh(bench, tmp_path)
    with open_bench(rig) as bench:
        assert require_fresh(bench, tmp_path) == first
        assert bench.last_check == first


@pytest.mark.thorough
def test_a_gain_change_since_the_last_check_is_stated_in_decibels_with_the_number_of_days(real, tmp_path):
    bench, virtual = real
    check_bench(bench, tmp_path, lambda: NOW - timedelta(days=2))
    virtual.faults.turn_amplifier_gain(bench.rig.amplifier.gain_db - 0.8)
    result = check_bench(bench, tmp_path, lambda: NOW)
    drifted = result.report["amplifier gain since last time"]
    assert drifted.value == "-0.80 dB in 2 days"
    assert drifted.verdict is Verdict.WARN
    assert "look for a changed knob" in drifted.advice
    assert result.report["drive over setting since last time"].verdict is Verdict.OK
    # The gain is still within one decibel of its knob: without the earlier check nobody would notice.
    assert result.report["amplifier gain"].verdict is Verdict.OK


@pytest.mark.thorough
def test_checks_of_different_configurations_are_not_compared(real, tmp_path):
    bench, _ = real
    store_result(bench.rig.model_copy(update={"calibration_valid_days": 1}))
    assert not [each for each in check_bench(bench, tmp_path).findings if "since" in each.name]


class TestKeeping:
    def test_only_the_last_check_of_each_rig_is_stored(self, rig, state_folder):
        other = rig.model_copy(update={"name": "another: rig/1"})
        store_result(rig, 3.0)
        last, apart = store_result(rig, 2.0), store_result(other)
        assert last_check(rig.name) == last
        assert last_check(other.name) == apart
        assert len(list(state_folder.rglob("*"))) == 1 + 2 * 2, "the last, and the last that passed"

    @pytest.mark.thorough
    def test_a_check_is_compared_with_the_last_passed_check(self, real, tmp_path):
        """A persistent fault must fail every check until a new reference is accepted."""
        bench, _ = real
        healthy = check_bench(bench, tmp_path)
        was_louder = tuple(
            each.model_copy(update={"number": 2 * each.number})
            if each.name.startswith("m0_velocity detects")
            else each
            for each in healthy.findings
        )
        keep(healthy.model_copy(update={"findings": was_louder}))
        name = "m0_velocity detects the sine since last time"
        for _ in range(2):
            found = check_bench(bench, tmp_path)
            assert found.report[name].verdict is Verdict.FAIL
            assert "as the new reference" in found.report[name].advice
        meant = check_bench(bench, tmp_path, new_reference=True)
        assert meant.verdict is not Verdict.FAIL
        assert check_bench(bench, tmp_path).report[name].verdict is Verdict.OK

    @pytest.mark.parametrize("content", ["", "{", '{"rig": 3}', "\x00\xff"])
    def test_a_damaged_check_file_counts_as_no_check(self, rig, state_folder, content):
        store_result(rig)
        archive_path(rig.name).write_bytes(content.encode("latin-1"))
        assert last_check(rig.name) is None

    def test_an_unwritable_folder_gives_a_one_sentence_error(self, rig, state_folder):
        state_folder.write_text("a file in the way")
        with pytest.raises(RecordingError, match="VIBENCH_STATE_DIR"):
            store_result(rig)

    def test_the_speed_of_simulated_time_does_not_change_the_digest_of_a_virtual_rig(self, rig):
        fast = rig.virtual.model_copy(update={"pace": "wall", "speed": 3.0})
        noisy = rig.virtual.model_copy(update={"seed": 99})
        assert rig_digest(rig) == rig_digest(rig.model_copy(update={"virtual": fast}))
        assert rig_digest(rig) != rig_digest(rig.model_copy(update={"virtual": noisy}))
