"""Values that a stuck converter holds or repeats, and zeros that pad a record, are not analysed as motion."""

import h5py
import numpy as np
import pytest
from scipy.io import savemat, wavfile

from vibench.acquisition import open_recording, validate
from vibench.analysis import analyse
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


def dwell(rng, noise=1e-4):
    """Return drive, base and response of a dwell."""
    turns = 2 * np.pi * HZ * np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
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


def imported(kind, folder, values, plan):
    """Return the recording of a file, and its analysis."""
    path = write(kind, folder, values)
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
CASES = [(kind, FAULTS[n % 3], ROWS[(3 * n + n // 8) % 4]) for n, kind in enumerate(3 * KINDS)]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # pyuff leaves a file open
@pytest.mark.parametrize(("kind", "fault", "row"), CASES)
def test_held_repeated_or_zero_values_at_the_end_of_a_record_are_left_out(tmp_path, kind, fault, row):
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


@pytest.mark.parametrize("row", [None, 0, 1, 2])
@pytest.mark.parametrize("fault", ["held", "zero"])
def test_values_held_within_a_record_are_counted_as_lost(tmp_path, fault, row):
    rng = np.random.default_rng([3, len(fault), 9 if row is None else row])
    values, at = dwell(rng), 12_000
    values[:, : at + 400] = faulty(values[:, : at + 400], fault, 400, row)
    with pytest.raises(Exception, match="samples were lost in this part"):
        imported("csv", tmp_path, values, SINE)


@pytest.mark.thorough
@pytest.mark.parametrize("noise", [0.0, 1e-4])
@pytest.mark.parametrize("plan", [SINE, HITS], ids=["dwell", "hits"])
@pytest.mark.parametrize("kind", ["csv", "h5", "wav 16 bit"])
def test_intact_records_are_kept_whole(tmp_path, kind, plan, noise):
    """Exactly periodic sines, the zeros around noise-free hits, and coarse counts are no fault."""
    values = (dwell if plan is SINE else hits)(np.random.default_rng(5), noise)
    values = np.vstack((values, np.full(values.shape[1], 0.21)))  # such as a temperature
    values[3, 100:] = 0.22
    kept, gaps, found = imported(kind, tmp_path, values, plan)
    assert (kept, gaps) == (values.shape[1], 0)
    assert not any(each.what == "Held values" for each in found.checks)
