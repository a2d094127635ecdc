"""Values that a stuck converter holds or repeats, and zeros that pad a record, are not analysed as motion."""

import h5py
import numpy as np
import pytest
from scipy.io import savemat, wavfile

from vibench.acquisition import open_recording, validate
from vibench.analysis import analyse
from vibench.analysis.errors import UnusableData
from vibench.analysis.exchange import ImportMapping, import_recording
from vibench.analysis.recordings.checks import Verdict

nptdms = pytest.importorskip("nptdms", reason="pip install vibench[exchange] brings npTDMS")
pyuff = pytest.importorskip("pyuff", reason="pip install vibench[test] brings pyuff")
RATE_HZ, HZ, SECONDS = 5120, 97.3, 6.0
KINDS = ("csv", "tdms", "uff a", "uff b", "mat", "h5", "wav", "wav 16 bit")
SINE = {
    "kind": "dwell",
    "amplitude_vpp": 1.6,
    "frequency_hz": HZ,
    "settle_s": 0.5,
    "duration_s": SECONDS - 0.5,
}
HITS = {
    "kind": "streamed_noise",
    "amplitude_vpp": 1.6,
    "band_start_hz": 20,
    "band_stop_hz": 500,
    "duration_s": SECONDS,
    "settle_s": 0.0,
}


def dwell(rng, noise=1e-4, hz=HZ):
    """Return drive, base and response of a dwell."""
    turns = 2 * np.pi * hz * np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    motion = np.stack((0.8 * np.cos(turns), 0.3 * np.cos(turns + 0.4), 0.5 * np.cos(turns - 1.0)))
    return motion + noise * rng.standard_normal(motion.shape)


def hits(rng, noise=1e-4):
    """Return force, base and response of six hits, without noise exactly zero before the first hit."""
    force = np.zeros(round(SECONDS * RATE_HZ))
    force[300::RATE_HZ] = 0.8
    time_s = np.arange(RATE_HZ) / RATE_HZ
    ring = 0.5 * np.exp(-20.0 * time_s) * np.sin(2 * np.pi * 150.0 * time_s)
    response = np.convolve(force, ring)[: force.size]
    motion = np.stack((force, 0.4 * force, response))
    return motion + noise * rng.standard_normal(motion.shape)


def write(kind, folder, values):  # noqa: C901 - one case per format
    """Write three channels in a format, with the digits or bits that are usual in it."""
    path, names = folder / f"a.{kind.split()[0]}", [f"c{number}" for number in range(1, len(values) + 1)]
    match kind.split():
        case ["csv"]:
            rows = "".join(f"{','.join(f'{x:.6g}' for x in row)}\n" for row in values.T)
            path.write_text(f"{','.join(names)}\n{rows}")
        case ["tdms"]:
            about = {"wf_increment": 1 / RATE_HZ}
            with nptdms.TdmsWriter(path) as writer:
                for name, row in zip(names, values, strict=True):
                    writer.write_segment([nptdms.ChannelObject("g", name, row, about)])
        case ["uff", form]:
            for name, row in zip(names, values, strict=True):
                about = {"func_type": 1, "rsp_node": 1, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0}
                about |= {
                    "ordinate_spec_data_type": {"c2": 12}.get(name, 11),
                    "orddenom_spec_data_type": 0,
                    "abscissa_spacing": 1,
                }
                about |= {"ord_data_type": 4, "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s"}
                x = np.arange(row.size) / RATE_HZ
                made = pyuff.prepare_58(binary=int(form == "b"), data=row, x=x, id1=name, **about)
                pyuff.UFF(str(path)).write_sets([made], "add")
        case ["mat"]:
            savemat(path, {"r": dict(zip(names, values, strict=True))})
        case ["h5"]:
            with h5py.File(path, "w") as file:
                for name, row in zip(names, values, strict=True):
                    file[f"r/{name}"] = row.astype(np.float32)
        case ["wav"]:
            wavfile.write(path, RATE_HZ, values.T.astype(np.float32))
        case ["wav", *_]:
            wavfile.write(path, RATE_HZ, np.rint(values.T * 32767).astype(np.int16))
    return path


def imported(kind, folder, values, plan, change=lambda content: content):
    """Return the recording of a file, whose bytes may be changed first, and its analysis."""
    path = write(kind, folder, values)
    path.write_bytes(change(path.read_bytes()))
    name = {"mat": "r.c{}", "h5": "/r/c{}", "wav": "{}", "wav 16 bit": "{}"}.get(kind, "c{}")
    roles = ("drive_voltage", "base_acceleration", "m0_velocity")
    content = {
        "started_utc": "2026-03-01T12:00:00Z",
        "sample_rate_hz": RATE_HZ,
        "measurement": {"name": "m", "excitation": plan},
        "channels": [
            {"source": name.format(number), "role": role, "scale": 1.0}
            for number, role in enumerate(roles, 1)
        ]
        + [{"source": name.format(4), "role": "room", "quantity": "temperature", "unit": "K", "scale": 1.0}]
        * (len(values) - 3),
    }
    made = import_recording(path, validate(content, ImportMapping, "test"), folder / "made.h5")
    with open_recording(made) as recording:
        return recording.samples, int(recording.gaps != ()), analyse(recording)


def faulty(values, fault, samples, row):
    """Return values whose last samples are held, repeated, or zero in one channel or in all."""
    rows = slice(None) if row is None else slice(row, row + 1)
    changed, at = values.copy(), values.shape[1] - samples
    changed[rows, at:] = {
        "held": values[rows, at : at + 1],
        "zero": 0.0,
        "repeated": values[rows, at - samples : at],
    }[fault]
    return changed


FAULTS, ROWS = ("held", "repeated", "zero"), (None, 0, 1, 2)
CASES = [(kind, FAULTS[n % 3], ROWS[(n + n // 4) % 4]) for n, kind in enumerate((*KINDS, *KINDS[:4]))]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # pyuff leaves a file open
@pytest.mark.parametrize(("kind", "fault", "row"), CASES)
def test_held_or_repeated_or_zero_values_at_the_end_of_a_record_are_left_out(tmp_path, kind, fault, row):
    seed = [KINDS.index(kind), len(fault), 9 if row is None else row]
    rng = np.random.default_rng(seed)
    values, samples = dwell(rng), int(rng.integers(150, 9000))
    kept, _, found = imported(kind, tmp_path, faulty(values, fault, samples, row), SINE)
    assert values.shape[1] - samples - 1 <= kept <= values.shape[1] - samples + 1
    (check,) = (each for each in found.checks if each.what == "Held values")
    assert check.verdict is Verdict.WARNING
    assert found.response.response_ii * found.response.drive.amplitude_m * 2 * np.pi * HZ == pytest.approx(
        0.5, rel=1e-3
    )


@pytest.mark.parametrize(("fault", "row"), [("held", None), ("held", 1), ("zero", 0), ("zero", 2)])
def test_values_held_within_a_record_are_counted_as_lost(tmp_path, fault, row):
    rng = np.random.default_rng([3, len(fault), 9 if row is None else row])
    values, at = dwell(rng), 12_000
    values[:, : at + 400] = faulty(values[:, : at + 400], fault, 400, row)
    with pytest.raises(Exception, match="samples were lost in this part"):
        imported("csv", tmp_path, values, SINE)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # pyuff leaves a file open
@pytest.mark.parametrize(
    ("kind", "row", "peak"),
    [(kind, 1 + n % 2, (1.05, 1.5, 3.2)[n % 3]) for n, kind in enumerate((*KINDS, "wav 16 bit", "csv"))],
)
def test_integers_that_overflowed_are_refused(tmp_path, kind, row, peak):
    rng = np.random.default_rng([4, row])
    values = dwell(rng, 2e-3)
    values[row] *= peak / np.abs(values[row]).max()
    values[row] = (np.rint(values[row] * 128) + 128) % 256 / 128 - 1  # 8 bits
    role = ("drive_voltage", "base_acceleration", "m0_velocity")[row]
    with pytest.raises(UnusableData, match=rf"{role} jumps at least \d+ times by .* wider integers"):
        imported(kind, tmp_path, values, SINE)
    assert not list(tmp_path.glob("made*"))


@pytest.mark.parametrize("turns", [1 / 5, 1 / 4, 0.3, 0.329])
def test_a_sine_with_few_samples_per_period_has_equal_responses_i_and_ii(tmp_path, turns):
    """At a quarter of the sample rate, the base counted as noise, and Response I was 10 % too small."""
    values = dwell(np.random.default_rng(9), hz=turns * RATE_HZ)
    found = imported("h5", tmp_path, values, SINE | {"frequency_hz": turns * RATE_HZ})[2].response
    assert found.response_i == pytest.approx(found.response_ii, rel=0.01)


@pytest.mark.parametrize("turns", [0.34, 0.41, 0.49])
def test_a_sine_with_less_than_three_samples_per_period_is_refused(tmp_path, turns):
    """At 0.41 of the sample rate, Response I was half as large as Response II, without a warning."""
    values = dwell(np.random.default_rng(9), hz=turns * RATE_HZ)
    with pytest.raises(UnusableData, match="3 samples per period are needed: record with a higher sample"):
        imported("h5", tmp_path, values, SINE | {"frequency_hz": turns * RATE_HZ})


@pytest.mark.parametrize("hz", [400.1, 811.7, 1511.1])
@pytest.mark.parametrize(("peak", "noise"), [(1.1, 1e-4), (3.2, 0.02)])
def test_overflows_of_a_sine_with_few_samples_per_period_are_refused(tmp_path, hz, peak, noise):
    """The report stated "quasi-periodic" and a Response II of a twentieth of the true one."""
    values = dwell(np.random.default_rng(8), noise, hz)
    values[2] = (peak * values[2] / np.abs(values[2]).max() + 1) % 2 - 1
    with pytest.raises(UnusableData, match=r"m0_velocity jumps at least \d+ times by its whole span"):
        imported("h5", tmp_path, values, SINE | {"frequency_hz": hz})


@pytest.mark.parametrize(("peak", "noise"), [(1.02, 0.03), (1.3, 0.06), (1.5, 0.1)])
def test_a_few_overflows_in_noise_are_refused(tmp_path, peak, noise):
    rng = np.random.default_rng([7, round(100 * peak)])
    values = dwell(rng, 1e-3)
    values[2] = peak * values[2] / np.abs(values[2]).max() + noise * rng.standard_normal(values.shape[1])
    values[2] = (values[2] + 1) % 2 - 1
    with pytest.raises(UnusableData, match=r"m0_velocity jumps at least \d+ times by its whole span"):
        imported("h5", tmp_path, values, SINE)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # pyuff leaves a file open
def test_a_universal_file_of_the_wrong_byte_order_is_refused_without_warnings_of_numpy(tmp_path):
    values = dwell(np.random.default_rng(1))
    with pytest.raises(UnusableData, match="but a recording stores only peaks"):
        imported("uff b", tmp_path, values, SINE, lambda raw: raw.replace(b"58b     1", b"58b     2"))


def test_square_waves_and_a_sawtooth_drive_do_not_count_as_overflows(tmp_path):
    values = dwell(np.random.default_rng(6))
    turns = HZ * np.arange(values.shape[1]) / RATE_HZ
    values[:2] = 1 - 2 * (turns % 1), 0.9 * np.sign(values[1]) + 1e-3 * values[2]
    assert imported("csv", tmp_path, values, SINE)[2].facts.channels[1].overflows == 0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_responses_to_a_base_without_a_signal_are_not_determined(tmp_path, seed):
    rng = np.random.default_rng(seed)
    values = dwell(rng)
    values[1] = 1e-3 * rng.standard_normal(values.shape[1])
    with pytest.raises(UnusableData, match=r"no sine at 97\.3 Hz that is clear of its noise"):
        imported("h5", tmp_path, values, SINE)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "plan", "noise"),
    [("csv", SINE, 0.0), ("wav 16 bit", SINE, 0.0), ("wav 16 bit", HITS, 0.0), ("h5", HITS, 1e-4)],
)
def test_intact_records_are_kept_completely(tmp_path, kind, plan, noise):
    """Exactly periodic sines, the zeros around noise-free hits, and coarse counts are no fault."""
    values = (dwell if plan is SINE else hits)(np.random.default_rng(5), noise)
    values = np.vstack((values, np.full(values.shape[1], 0.21)))  # such as a temperature
    values[3, 100:] = 0.22
    kept, gaps, found = imported(kind, tmp_path, values, plan)
    assert (kept, gaps) == (values.shape[1], 0)
    assert not any(each.what == "Held values" for each in found.checks)
