"""Feedback on the virtual rig: verdicts, levels, jumps and modes match simulation and closed form."""

import json

import numpy as np
import pytest

from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.excitation.plan import BaseLevel, JumpSearch, Settling
from vibench.acquisition.plan import (
    Direction,
    HeldDwell,
    Measurement,
    ResonanceTracking,
    RunState,
    SettledSine,
)
from vibench.acquisition.run.silence_watch import fit_sine
from vibench.sim import Harmonic, PhaseReference, gong2025, integrate, phase_resonance_branch

SAMPLE_RATE_HZ = 10240.0
HEAVY_KG = 0.6
"""Fixture mass that the specimen hardly moves, so that the base is the sine of the simulation."""
SPECIMEN = gong2025()


@pytest.fixture
def record_run(rig, tmp_path):
    """Return a function that carries out an excitation on the virtual rig and opens the recording."""
    opened = []

    def carry_out(excitation, fixture_kg=HEAVY_KG, **spring):
        specimen = rig.specimen.model_copy(update=spring)
        shaker = rig.shaker.model_copy(update={"fixture_mass_kg": fixture_kg})
        daq = rig.daq.model_copy(update={"sample_rate_hz": SAMPLE_RATE_HZ})
        plan = Measurement(name="run", excitation=excitation, ramp_s=0.4, ramp_step_s=0.02)
        path = tmp_path / f"run{len(opened)}.h5"
        used = rig.model_copy(update={"shaker": shaker, "daq": daq, "specimen": specimen})
        with open_bench(used) as bench:
            outcome = run_measurement(bench, plan, path)
        assert outcome.state is RunState.FINISHED
        opened.append(open_recording(outcome.path))
        return opened[-1]

    yield carry_out
    for recording in opened:
        recording.close()


def notes_of(recording, kind):
    return [json.loads(event.text) for event in recording.events if event.kind == kind]


def simulated_period(frequency_hz, amplitude_m, longest=8):
    """Return after how many drive periods the simulated state repeats to a thousandth; 0 if it does not."""
    periods = round(4 * frequency_hz)
    drive = Harmonic(frequency_hz, amplitude_m)
    motion = integrate(SPECIMEN, drive, periods / frequency_hz, sample_rate_hz=frequency_hz)
    states = np.asarray(motion.states)[-80:]
    size = np.sqrt(np.mean(states**2, axis=0))
    for period in range(1, longest + 1):
        if np.max(np.abs(states[period:] - states[:-period]) / size) < 1e-3:
            return period
    return 0


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("frequency_hz", "amplitude_m", "period"),
    [
        (260.0, 1e-6, 1),
        (74.0, 30e-6, 2),
        pytest.param(70.0, 40e-6, 3, marks=pytest.mark.slow),
        (260.0, 5e-6, 0),
    ],
)
def test_the_measured_period_matches_the_simulation(record_run, frequency_hz, amplitude_m, period):
    assert simulated_period(frequency_hz, amplitude_m) == period
    plan = HeldDwell(
        amplitude_vpp=4.0,
        frequency_hz=frequency_hz,
        base_level=BaseLevel(displacement_m=amplitude_m),
        duration_s=0.3,
    )
    found = notes_of(record_run(plan), "settled")[-1]
    assert found["period"] == period
    assert found["motion"] == ("periodic" if period else "aperiodic")
    assert found["level"] == "within tolerance"


@pytest.mark.thorough
def test_the_base_level_is_held_despite_impact_ringing_on_a_light_table(record_run):
    plan = HeldDwell(
        amplitude_vpp=2.0,
        frequency_hz=260,
        base_level=BaseLevel(displacement_m=5e-6),
        duration_s=4,
    )
    recording = record_run(plan, fixture_kg=0.07)
    dwell = next(each for each in recording.segments if each.label == "dwell")
    base = recording.read("base_acceleration", dwell.first_sample, dwell.last_sample + 1)
    drive = recording.read("drive_voltage", dwell.first_sample, dwell.last_sample + 1)
    target = 5e-6 * (2 * np.pi * 260) ** 2
    # Fit at the frequency of the recorded drive: the clocks of generator and converter differ.
    measured = fit_sine(base, true_frequency_hz(drive), SAMPLE_RATE_HZ).amplitude
    assert abs(measured / target - 1) < 0.025
    # Impacts do ring: the remaining motion of the base is not small.
    assert np.var(base) - measured**2 / 2 > (0.1 * measured) ** 2 / 2
    assert notes_of(recording, "settled")[-1]["motion"] == "aperiodic"


def true_frequency_hz(drive):
    """Return the frequency of the drive, from the phase difference of the two halves of the record."""
    half = drive.size // 2
    time_s = np.arange(half) / SAMPLE_RATE_HZ
    turning = np.exp(-2j * np.pi * 260 * time_s)
    first, second = np.sum(drive[:half] * turning), np.sum(drive[half : 2 * half] * turning)
    turned = np.angle(second / first) - 2 * np.pi * 260 * half / SAMPLE_RATE_HZ
    return 260 + ((turned + np.pi) % (2 * np.pi) - np.pi) * SAMPLE_RATE_HZ / (2 * np.pi * half)


def linear_response(frequency_hz):
    """Return the displacements of m0, m1 and m2 over that of the base, without contact."""
    omega = 2 * np.pi * frequency_hz
    s = SPECIMEN
    dynamic = s.stiffness_matrix + 1j * omega * s.damping_matrix - omega**2 * s.mass_matrix
    return np.linalg.solve(dynamic, [s.stiffnesses[0] + 1j * omega * s.dampings[0], 0, 0])


def grazing_hz(low_hz, high_hz, amplitude_m):
    """Return the frequency at which the linear relative motion of m1 and m2 just reaches the gap."""
    grid_hz = np.arange(low_hz, high_hz, 0.01)
    reach = [abs(np.subtract(*linear_response(f)[1:])) * amplitude_m - SPECIMEN.gap_m for f in grid_hz]
    (crossing,) = np.flatnonzero(np.diff(np.sign(reach)))
    return grid_hz[crossing]


BELOW = (250.0, 257.0)
ABOVE = (277.0, 281.0, 285.0, 290.0, 295.0, 300.0, 310.0, 320.0, 330.0, 340.0)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("frequencies_hz", "direction", "between_hz"),
    [
        (BELOW, Direction.UP, (250.0, 260.0)),
        pytest.param(ABOVE, Direction.DOWN, (272.0, 285.0), marks=pytest.mark.slow),
    ],
)
def test_a_sweep_jumps_where_its_linear_branch_first_touches_the_stops(
    record_run, frequencies_hz, direction, between_hz
):
    plan = SettledSine(
        amplitude_vpp=4.0,
        frequencies_hz=frequencies_hz,
        direction=direction,
        record_s=0.3,
        glide_step_hz=1.0,
        settling=Settling(longest_wait_s=8),
        base_level=BaseLevel(displacement_m=3e-6),
        jumps=JumpSearch(factor=1.45, resolution_hz=0.3),
        search_s=240,
    )
    (jump,) = [each for each in notes_of(record_run(plan), "jump") if each["how"] != "steep, but no jump"]
    assert jump["how"] == "localised"
    low_hz, high_hz = sorted((jump["before_hz"], jump["after_hz"]))
    assert high_hz - low_hz <= 0.3
    # The base level is held to 0.75 %, which moves grazing by 0.15 Hz; the jumps up and down are 24 Hz apart.
    assert low_hz - 0.2 <= grazing_hz(*between_hz, 3e-6) <= high_hz + 0.2


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("start_hz", "span_hz", "step_hz", "acceleration", "paper_hz", "of"),
    [
        (94.5, 1.5, 0.4, 0.1, 95, PhaseReference.RELATIVE),
        (264.0, 20, 3, 0.5, 266, PhaseReference.RELATIVE),
        (496.0, 30, 6, 0.6, 500, PhaseReference.ABSOLUTE),
    ],
)
def test_linear_modes_are_tracked_to_their_phase_resonance(
    record_run, start_hz, span_hz, step_hz, acceleration, paper_hz, of
):
    plan = ResonanceTracking(
        amplitude_vpp=1.0,
        start_hz=start_hz,
        low_hz=start_hz - span_hz,
        high_hz=start_hz + span_hz,
        widest_step_hz=step_hz,
        phase_of=of,
        accelerations_m_per_s2=(acceleration,),
        settling=Settling(tolerance=0.02),
        record_s=0.3,
    )
    found = notes_of(record_run(plan, fixture_kg=0.07), "resonance")[0]
    grid_hz = np.arange(start_hz - 1.2, start_hz + 6, 0.005)
    quadrature = np.array([of.motion(linear_response(f)[0]).real for f in grid_hz])
    expected_hz = grid_hz[int(np.argmax(quadrature < 0))]
    assert found["lock"] == "locked"
    assert abs(found["frequency_hz"] - expected_hz) < 2 * found["frequency_u_hz"] + 0.01
    assert found["frequency_u_hz"] < 0.15
    mode = int(np.argmin(np.abs(SPECIMEN.natural_frequencies_hz - paper_hz)))
    natural_hz, damping = SPECIMEN.natural_frequencies_hz[mode], SPECIMEN.damping_ratios[mode]
    assert abs(found["mode_hz"] - natural_hz) < 3 * found["mode_u_hz"] + 1e-4 * natural_hz
    assert found["damping_ratio"] == pytest.approx(damping, rel=0.03)
    assert round(found["mode_hz"]) == paper_hz


@pytest.mark.thorough
def test_a_resonance_with_impacts_is_followed_while_the_motion_is_steady(record_run):
    plan = ResonanceTracking(
        amplitude_vpp=1.0,
        start_hz=94.5,
        low_hz=92,
        high_hz=104,
        widest_step_hz=0.4,
        accelerations_m_per_s2=(0.16, 0.19, 0.22, 0.26, 0.3, 0.34, 0.38, 0.43, 0.48, 0.54, 0.6),
        flank_pairs=2,
        record_s=0.3,
    )
    found = [each for each in notes_of(record_run(plan), "resonance") if each["frequency_hz"]]
    model = phase_resonance_branch(SPECIMEN, (92.0, 97.0), (4.5e-7, 1.6e-6))
    level = model.amplitudes_m * (2 * np.pi * model.frequencies_hz) ** 2
    onward = model.frequencies_hz > 95.0
    colliding = [each for each in found if each["frequency_hz"] > 95.0]
    # Whether one more level locks in time depends on how the quasi-periodic motion ends as contacts begin.
    assert len([each for each in colliding if each["asked_m_per_s2"] > 0.35]) >= 4
    for each in colliding:
        expected_hz = np.interp(each["base_m_per_s2"], level[onward], model.frequencies_hz[onward])
        expected = np.interp(each["base_m_per_s2"], level[onward], model.response_ii[onward, 0])
        assert abs(each["frequency_hz"] - expected_hz) < 3 * each["frequency_u_hz"] + 0.01
        assert each["response_ii"] == pytest.approx(expected, rel=0.02)
        assert each["periods"] <= 150
        assert abs(each["phase_deg"] + 90) < 1
        assert each["motion"] == "periodic"


def track_resonance(near_hz, *levels, **options):
    """Return a plan to track a super- or subharmonic resonance at base levels [m/s2]."""
    chosen = {
        "start_hz": near_hz,
        "low_hz": near_hz - 5,
        "high_hz": near_hz + 7,
        "widest_step_hz": 0.4,
        "settling": Settling(tolerance=0.02, longest_wait_s=6.0),
        "most_tries": 12,
    }
    return ResonanceTracking(amplitude_vpp=9.0, accelerations_m_per_s2=levels, **(chosen | options))


def bumpers(below_m, above_m, stiffness=100):
    return {"contact": f"linear_gap:{stiffness}", "gap_m": (below_m, above_m)}


@pytest.mark.thorough
def test_a_superharmonic_resonance_matches_harmonic_balance(record_run):
    """The reference is harmonic balance of both levels (`benchmarks/backbones.py --superharmonic`)."""
    k1 = 2.1e-3 * (2 * np.pi * 100) ** 2
    cubic = {"contact": "power:3", "gap_m": 99e-6, "hertz_stiffness": 0.1 * k1 * 1e-4 / 1e-9}
    found = notes_of(record_run(track_resonance(31.6, 10.92, 12.07, harmonic=3), **cubic), "resonance")
    assert [each["lock"] for each in found] == ["locked"] * 2
    levels, hertz, third_m = (9.88, 10.92, 12.07), (31.764, 31.802, 31.849), (1.55e-7, 2.08e-7, 2.80e-7)
    for each in found:
        model_hz, model_m = (np.interp(each["base_m_per_s2"], levels, model) for model in (hertz, third_m))
        assert each["frequency_hz"] == pytest.approx(model_hz, abs=2 * each["frequency_u_hz"])
        assert each["frequency_u_hz"] < 0.006
        assert each["harmonic_m"] == pytest.approx(model_m, rel=0.03)
    assert found[1]["periods"] <= 150


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("gap_m", "phase_deg"), [((60e-6, 30e-6), -90), pytest.param((30e-6, 60e-6), 90, marks=pytest.mark.slow)]
)
def test_the_second_superharmonic_is_tracked_whichever_bumper_is_nearer(record_run, gap_m, phase_deg):
    """The reference is harmonic balance (`benchmarks/backbones.py --superharmonic 2 --spring bumpers`)."""
    plan = track_resonance(47.5, 10.38, 10.78, harmonic=2, phase_deg=phase_deg)
    found = notes_of(record_run(plan, **bumpers(*gap_m)), "resonance")
    assert [each["lock"] for each in found] == ["locked"] * 2
    levels, hertz, second_m = (10, 10.5, 11), (47.756, 47.830, 47.881), (5.14e-7, 6.78e-7, 8.17e-7)
    for each in found:
        model_hz, model_m = (np.interp(each["base_m_per_s2"], levels, model) for model in (hertz, second_m))
        assert each["frequency_hz"] == pytest.approx(model_hz, abs=2 * each["frequency_u_hz"])
        assert each["frequency_u_hz"] < 0.01
        assert each["harmonic_m"] == pytest.approx(model_m, rel=0.03)
    assert found[1]["periods"] <= 150


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("gap_m", "phase_deg", "model_hz", "model_m"),
    [
        ((60e-6, 30e-6), -90, 193.175, 2.075e-6),
        pytest.param((30e-6, 60e-6), 90, 193.175, 2.075e-6, marks=pytest.mark.slow),
    ],
)
def test_a_subharmonic_resonance_is_found_from_twice_the_phase_of_m0(
    record_run, gap_m, phase_deg, model_hz, model_m
):
    """Compare `benchmarks/backbones.py --subharmonic 2 --spring bumpers` at a base of 23.64 m/s2."""
    settling = Settling(tolerance=0.02, longest_wait_s=20.0)
    plan = track_resonance(
        192, 23.64, subharmonic=2, phase_deg=phase_deg, settling=settling, widest_step_hz=0.5, most_tries=25
    )
    recording = record_run(plan, **bumpers(*gap_m))
    (found,) = notes_of(recording, "resonance")
    assert found["lock"] == "locked"
    # The resonance moves by 0.17 Hz per m/s2.
    expected_hz = model_hz + 0.17 * (found["base_m_per_s2"] - 23.64)
    assert found["frequency_hz"] == pytest.approx(expected_hz, abs=3 * found["frequency_u_hz"])
    assert found["frequency_u_hz"] < 0.1
    assert found["harmonic_m"] == pytest.approx(model_m, rel=0.03)
    assert notes_of(recording, "achieved")[-1]["period"] == 2


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("subharmonic", "start_hz"), [(2, 192), pytest.param(3, 290, marks=pytest.mark.slow)]
)
def test_no_subharmonic_is_found_in_a_motion_of_period_one(record_run, subharmonic, start_hz):
    """Noise at half the drive has a random phase, which can lie within a tolerance of 30 degrees."""
    plan = track_resonance(start_hz, 2, 3, subharmonic=subharmonic, phase_tolerance_deg=30)
    found = notes_of(record_run(plan, **bumpers(60e-6, 25e-6, 150)), "resonance")
    assert [each["lock"] for each in found] == ["no motion of that period"] * 2
    assert [each["tries"] for each in found] == [1, 1]


@pytest.mark.thorough
def test_a_phase_search_ends_where_the_motion_and_its_phase_jump(record_run):
    """Below 197 Hz, m0's motion at half the drive is small, then jumps; bisection must not continue there."""
    plan = track_resonance(197, 24, low_hz=187, high_hz=199, subharmonic=2, most_tries=25)
    (found,) = notes_of(record_run(plan, **bumpers(60e-6, 25e-6, 150)), "resonance")
    assert found["lock"] == "a jump of the phase, as between two motions"
    assert found["tries"] < 25
