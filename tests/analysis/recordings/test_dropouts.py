"""Vibrometer drop-outs are found without false detections, and bridged accurately."""

import random
from dataclasses import replace

import h5py
import numpy as np
import pytest

from tests.analysis.virtual_measurements import RIG, record, simulated_with
from vibench.acquisition import open_recording
from vibench.acquisition.plan import Dwell, SineSweep, WhiteNoise
from vibench.acquisition.recording import BridgedChannel, Dropout, bridge, find_dropouts
from vibench.acquisition.rig import Rig
from vibench.analysis import Simulation, analyse, analyse_files
from vibench.analysis.recordings.checks import Verdict, measurement_checks
from vibench.analysis.recordings.facts import recording_facts
from vibench.sim import shipped_specimens

from ...attack.doubtful_recordings import dark_recording, generator

RATE_HZ = 51_200.0
ROLE = "m0_velocity"


def motion(seed, seconds=1.0, noise=3e-6):
    """Return sines and white noise [m/s], similar to the velocity of m0 under weak noise."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    sines = sum(
        rng.uniform(0.001, 0.05) * np.sin(2 * np.pi * rng.uniform(50, 600) * time_s + rng.uniform(0, 6))
        for _ in range(5)
    )
    return sines + noise * rng.standard_normal(time_s.size)


def with_drop_out(velocity, at, samples, level):
    dark = velocity.copy()
    dark[at : at + samples] = level
    return dark


@pytest.mark.parametrize("seed", range(12))
def test_a_drop_out_is_found_and_bridged(seed):
    rng = np.random.default_rng((seed, 1))
    velocity = motion(seed)
    begins = np.arange(2_000, 48_000, 9_000) + rng.integers(0, 4_000, 6)
    dark = velocity
    for at in begins:
        level = float(rng.choice((-1, 1)) * rng.uniform(0.3, 1.0))
        dark = with_drop_out(dark, at, int(rng.integers(1, 100)), level)
    found = find_dropouts(dark, RATE_HZ)
    assert [bool(each.first <= at < each.stop) for each, at in zip(found, begins, strict=True)] == [True] * 6
    assert np.max(np.abs(bridge(dark, found) - velocity)) < 0.02 * np.std(velocity)


@pytest.mark.parametrize("noise", [3e-6, 2e-3, 1e-2])
@pytest.mark.parametrize("level", ["zero", "last"])
def test_drop_outs_to_a_constant_value_are_found_at_any_noise_level(noise, level):
    """Zeros in a noisy sweep were once read as motion: Response II was 0.923 +- 0.012; 0.968 is true."""
    dark = motion(11, noise=noise)
    begins = np.arange(2_000, 48_000, 4_000)
    for at, samples in zip(begins, np.linspace(10, 190, begins.size).astype(int), strict=True):
        dark = with_drop_out(dark, at, samples, 0.0 if level == "zero" else dark[at - 1])
    found = find_dropouts(dark, RATE_HZ)
    assert [each.first <= at < each.stop for each, at in zip(found, begins, strict=True)] == [True] * 12


@pytest.mark.parametrize("quantum", [1e-5, 3e-4, 3e-3, 1e-2])
@pytest.mark.parametrize("noise", [0.0, 3e-6, 1e-3])
def test_a_coarsely_quantised_channel_with_impacts_has_no_drop_outs(quantum, noise):
    velocity = motion(12, noise=noise)
    for at in range(1_000, 50_000, 2_500):
        velocity[at:] += 0.05 * (-1) ** (at // 2_500)
    assert find_dropouts(np.round(velocity / quantum) * quantum, RATE_HZ) == ()


@pytest.mark.thorough
@pytest.mark.parametrize("number", [6, 8])
def test_a_sweep_with_drop_outs_to_zero_gives_no_wrong_result(number, tmp_path):
    """Sweep 6 once gave 3.452 +- 0.031; 3.538 is true."""
    chance = random.Random(f"4303:{number}")
    assert dark_recording(generator(chance), tmp_path).faults == ()


def test_two_drop_outs_close_to_each_other_are_both_bridged():
    velocity = motion(3)
    dark = with_drop_out(with_drop_out(velocity, 20_000, 12, 0.8), 20_250, 20, -0.6)
    found = find_dropouts(dark, RATE_HZ)
    assert len(found) == 2
    assert np.max(np.abs(bridge(dark, found) - velocity)) < 0.02 * np.std(velocity)


def test_drop_outs_with_too_little_motion_between_them_are_not_bridged():
    dark = motion(10)[:1_500]
    many = tuple(Dropout(at, at + 40) for at in range(20, 1_440, 60))
    assert np.array_equal(bridge(dark, many), dark)


def test_a_clipped_peak_is_not_a_drop_out():
    velocity = 1.2 * np.sin(2 * np.pi * 5 * np.arange(51_200) / RATE_HZ)
    velocity = np.clip(velocity, -1.0, 1.0) + 3e-6 * np.random.default_rng(0).standard_normal(51_200)
    assert find_dropouts(velocity, RATE_HZ) == ()
    fast = 1.02 * np.sin(2 * np.pi * 20 * np.arange(51_200) / RATE_HZ)
    fast = np.clip(fast, -1.0, 1.0) + 3e-6 * np.random.default_rng(0).standard_normal(51_200)
    assert find_dropouts(fast, RATE_HZ) == ()


@pytest.mark.parametrize("step", [0.01, 0.1, 1.0])
def test_a_lasting_velocity_step_of_an_impact_is_not_a_drop_out(step):
    velocity = motion(4)
    velocity[20_000:] += step
    assert find_dropouts(velocity, RATE_HZ) == ()


def test_ringing_after_an_impact_is_not_a_drop_out():
    velocity = motion(5)
    after = np.arange(velocity.size - 20_000) / RATE_HZ
    velocity[20_000:] += 0.5 * np.exp(-after / 0.01) * np.sin(2 * np.pi * 4_000 * after)
    assert find_dropouts(velocity, RATE_HZ) == ()


@pytest.mark.parametrize(
    "velocity",
    [np.zeros(51_200), np.full(51_200, np.nan), motion(6)[:300], np.round(motion(7), 2)],
    ids=["silent", "lost", "short", "coarse"],
)
def test_ambiguous_signals_do_not_count_as_drop_outs(velocity):
    assert find_dropouts(velocity, RATE_HZ) == ()


def test_long_drop_outs_are_not_bridged():
    assert find_dropouts(with_drop_out(motion(8), 20_000, 2_000, 0.0), RATE_HZ) == ()


def test_drop_outs_are_not_searched_for_below_a_sample_rate_of_20_khz():
    assert find_dropouts(with_drop_out(motion(9), 20_000, 12, 0.8), 19_000.0) == ()


def measure(rig, plan, path, dropouts_per_s, seed=5, **how):
    return record(path, plan, simulated_with(rig, vibrometer_dropouts_per_s=dropouts_per_s, seed=seed), **how)


@pytest.mark.thorough
def test_bridged_drop_outs_do_not_change_the_results_of_a_dwell(tmp_path):
    """Response I was once 91, called a lower bound; 1.63 is true."""
    plan = Dwell(amplitude_vpp=0.05, frequency_hz=180, settle_s=1, duration_s=6)
    results = []
    for dropouts_per_s in (0.0, 4.0):
        path = measure(RIG, plan, tmp_path / f"d{dropouts_per_s:g}.h5", dropouts_per_s)
        results.append(analyse(path))
    light, dark = (each.response for each in results)
    assert dark.response_i == pytest.approx(light.response_i, rel=2e-3)
    assert dark.response_ii == pytest.approx(light.response_ii, abs=4 * light.sd_response_ii)
    checks = {each.what: each for each in results[1].checks}
    assert "the vibrometer lost its signal" in checks["Drop-outs"].text
    assert checks["Overloads"].verdict is Verdict.PASSED


@pytest.mark.thorough
@pytest.mark.parametrize(("dropouts_per_s", "seed"), [(20.0, 2), (20.0, 13), (60.0, 1)])
def test_clustered_drop_outs_change_no_reported_result_of_a_dwell(tmp_path, dropouts_per_s, seed):
    """Response I was once 58 +- 16, and 48 +- 51 with 60 drop-outs per second; 3.21 is true."""
    document = RIG.model_dump(mode="json")
    document["specimen"]["contact"] = "linear"
    plan = Dwell(amplitude_vpp=1.0, frequency_hz=230, settle_s=1, duration_s=6)
    path = measure(Rig.model_validate(document), plan, tmp_path / "d.h5", dropouts_per_s, seed)
    done = analyse_files([path], "d", Simulation.LEFT_OUT)
    if done.results:
        assert done.results[0].analysis.response.response_i == pytest.approx(3.21, rel=0.02)
    else:
        assert "lost its signal" in done.failures[0].sentence


@pytest.mark.thorough
@pytest.mark.parametrize(
    "plan",
    [
        Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=1, duration_s=6),
        Dwell(amplitude_vpp=6.0, frequency_hz=397, settle_s=1, duration_s=6),
        SineSweep(amplitude_vpp=3.0, start_hz=220, stop_hz=300, duration_s=6, settle_s=1),
        WhiteNoise(
            amplitude_vpp=5.0, band_start_hz=50, band_stop_hz=600, repetition_hz=2, realisations=3, settle_s=1
        ),
    ],
    ids=["chaos", "strong", "sweep", "noise"],
)
def test_drop_outs_and_collisions_are_distinguished(tmp_path, plan):
    """Bridged samples differ from those of a run without drop-outs by at most 2 % of the motion."""
    with open_recording(measure(RIG, plan, tmp_path / "light.h5", 0.0)) as recording:
        light = recording.read(ROLE)
        assert BridgedChannel(recording, ROLE).between(0, recording.samples) == ()
    with open_recording(measure(RIG, plan, tmp_path / "dark.h5", 3.0)) as recording:
        dark, mended = recording.read(ROLE), BridgedChannel(recording, ROLE).read(0, recording.samples)
        facts = recording_facts(recording)
    assert facts.dropouts > 5
    assert np.max(np.abs(dark - light)) > 0.5
    assert np.sqrt(np.mean((mended - light) ** 2)) < 0.02 * np.std(light)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [7, 9])
def test_drop_outs_a_few_milliseconds_apart_are_bridged_with_errors_below_2_percent(tmp_path, seed):
    """Ringing joined such drop-outs beyond the longest bridge: Response I was 617; 22.6 is true."""
    plan = Dwell(amplitude_vpp=0.02, frequency_hz=266, settle_s=1, duration_s=4)
    read = []
    for dropouts_per_s in (0.0, 20.0):
        path = tmp_path / f"{dropouts_per_s:g}.h5"
        how = {"bench_check": "recently passed", "seed": seed}
        with open_recording(measure(RIG, plan, path, dropouts_per_s, **how)) as recording:
            read.append(BridgedChannel(recording, ROLE).read(0, recording.samples - 1_000))
    light, mended = read
    assert np.max(np.abs(mended - light)) < 0.02 * np.max(np.abs(light))


@pytest.mark.thorough
@pytest.mark.parametrize("name", [each for each in shipped_specimens() if each != "two_masses"])
def test_no_collision_of_a_shipped_specimen_is_reported_as_a_drop_out(tmp_path, name):
    """The shipped specimens include one-sided stops, rigid stops and a heavy m1."""
    document = RIG.model_dump(mode="json")
    document["specimen"] = {
        "model": name,
        "amplitude_limit_m": document["specimen"]["amplitude_limit_m"] | {"value": 1.0},
    }
    document["shaker"]["limits"]["force_n"]["value"] = 1e3
    other = Rig.model_validate(document)
    noise = WhiteNoise(
        amplitude_vpp=8.0, band_start_hz=50, band_stop_hz=600, repetition_hz=2, realisations=2, settle_s=1
    )
    dwells = (Dwell(amplitude_vpp=8.0, frequency_hz=each, settle_s=1, duration_s=3) for each in (140, 200))
    for number, plan in enumerate((noise, *dwells)):
        path = tmp_path / f"{number}.h5"
        with open_recording(measure(other, plan, path, 0.0, bench_check="recently passed")) as recording:
            assert recording_facts(recording).dropouts == 0


@pytest.mark.thorough
def test_drop_outs_in_a_part_of_a_recording_are_bridged_as_in_the_whole_recording(tmp_path):
    plan = Dwell(amplitude_vpp=0.5, frequency_hz=200, settle_s=0.5, duration_s=2)
    with open_recording(measure(RIG, plan, tmp_path / "d.h5", 8.0)) as recording:
        whole = BridgedChannel(recording, ROLE).read(0, recording.samples)
        dropouts = BridgedChannel(recording, ROLE).between(0, recording.samples)
        assert len(dropouts) > 5
        for each in dropouts[1:-1]:
            inside = (each.first + each.stop) // 2
            part = BridgedChannel(recording, ROLE).read(inside, inside + 3_000)
            assert part == pytest.approx(whole[inside : inside + 3_000], abs=2e-5)
            assert isinstance(each, Dropout)


@pytest.mark.thorough
def test_an_unusual_sampling_rate_is_accepted(tmp_path):
    plan = Dwell(amplitude_vpp=0.5, frequency_hz=200, settle_s=0.5, duration_s=1)
    path = measure(RIG, plan, tmp_path / "d.h5", 0.0)
    for rate_hz in (1e-6, 0.4, 1e12):
        with h5py.File(path, "r+") as file:
            file.attrs["sample_rate_hz"] = rate_hz
        with open_recording(path) as recording:
            assert BridgedChannel(recording, ROLE).between(0, recording.samples) == (), rate_hz


@pytest.mark.thorough
def test_many_drop_outs_give_a_warning(tmp_path):
    plan = Dwell(amplitude_vpp=0.5, frequency_hz=200, settle_s=0.5, duration_s=2)
    with open_recording(measure(RIG, plan, tmp_path / "d.h5", 1.0)) as recording:
        facts = recording_facts(recording)
    (note,) = (each for each in measurement_checks(facts) if each.what == "Drop-outs")
    (warning,) = (
        each
        for each in measurement_checks(replace(facts, dropouts=30, dropout_s=0.02 * facts.duration_s))
        if each.what == "Drop-outs"
    )
    assert (note.verdict, warning.verdict) == (Verdict.NOTE, Verdict.WARNING)
    left = replace(facts, overload_s={ROLE: 1e-3})
    (overload,) = (each for each in measurement_checks(left) if each.what == "Overloads")
    assert "do not trust Response I" in overload.text  # not "a lower bound": it was 5700 times too large
