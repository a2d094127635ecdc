"""Study files are self-describing, consistent after power cuts, resumed and never overwritten."""

import itertools
import json
import random
import threading

import h5py
import numpy as np
import pytest

from vibench.sim import Rest, ScenePrediction, solve_scene
from vibench.sim.study import (
    ExistingStudy,
    PointState,
    Study,
    StudyError,
    ThreadExecutor,
    open_study,
    run_study,
    solve_study,
)
from vibench.sim.study._file_store import FileStore, make_file, sole_writer
from vibench.sim.study._grid import COLUMNS, IDENTITY, NUMBERS, SESSION, STATE
from vibench.sim.study._queue import StudyEnd
from vibench.sim.study._study import scene_identity

from .conftest import SHORT


@pytest.fixture(scope="module")
def small():
    return Study(
        frequencies_hz=[200.0, 260.0],
        amplitudes_m=[5e-6, 20e-6],
        models=("hertz", "linear"),
        starts=("rest", "up"),
        **SHORT,
    )


@pytest.fixture(scope="module")
def solved(small, tmp_path_factory):
    """Content of the file of a computed study."""
    path = tmp_path_factory.mktemp("solved") / "a.h5"
    solve_study(small, path)
    return path.read_bytes()


@pytest.fixture
def path(small, tmp_path):
    """Return the path of a study's file without results."""
    make_file(tmp_path / "a.h5", small)
    return tmp_path / "a.h5"


def run_into_file(path, study, solver=solve_scene, cancelled=None):
    """Run or resume a study in its file; return the computed scenes and how the run ended."""
    begun = []

    def solve_and_note(scene):
        begun.append(scene)
        return solver(scene)

    executor = ThreadExecutor(2, solve_and_note)
    with FileStore(path, study) as store:
        end = run_study(study, executor, store, cancelled=cancelled)
    executor.close()
    return begun, end


def test_every_prediction_field_of_fixed_length_is_stored():
    kept = set(NUMBERS) | {"motion", "method", "outcome", "ended", "final_state", "memory", "ensemble"}
    of_the_study = {"frequency_hz", "amplitude_m", "accuracy", "start"}
    of_any_length = {"section", "spectrum", "spectrum_hz"}
    of_the_call = {"target"}  # the request is not stored; the reached error is
    fields = set(ScenePrediction.__dataclass_fields__)
    assert fields == kept | of_the_study | of_any_length | of_the_call


def test_a_study_file_round_trips(small, tmp_path, require_equal):
    in_memory = solve_study(small)
    in_file = solve_study(small, tmp_path / "a.h5")
    require_equal(in_file, in_memory)
    require_equal(open_study(tmp_path / "a.h5"), in_memory)
    again = [each.to_dict() for each in in_file.predictions()]
    assert again == [each.to_dict() for each in in_memory.predictions()]
    assert json.loads(json.dumps(again, allow_nan=False)) == again


@pytest.mark.thorough
def test_motions_of_an_ensemble_round_trip_through_the_study_file(tmp_path):
    """Chaos ends within a few tens of seconds here: some runs have settled after 12 s."""
    study = Study(
        frequencies_hz=[242.0],
        amplitudes_m=[5e-6],
        damping_times_s=[3e-5],
        duration_s=12.0,
        window_s=2.0,
        budget_s=0.2,
    )
    (found,) = solve_study(study, tmp_path / "a.h5").predictions()
    made = solve_scene(study.scene((0,) * 6, REST))
    assert found.ensemble == made.ensemble
    assert len(found.ensemble.motions) > 1
    with h5py.File(tmp_path / "a.h5") as file:
        shares = file["found_share"][...].ravel()
        assert np.nansum(shares) == pytest.approx(1.0)
        assert file["found_share"].dims[6][0].name == "/found_motion"
        assert np.count_nonzero(file["found_kind"][...] >= 0) == len(found.ensemble.motions)


REST = Rest()


def test_h5py_alone_finds_the_named_axes_the_units_and_the_missing_points(path):
    with h5py.File(path) as file:
        response = file["response_i"]
        assert [dim.label or dim[0].name for dim in response.dims] == [
            "/model", "/damping_time", "/gap", "/amplitude", "/start", "/frequency"
        ]  # fmt: skip
        assert response.attrs["units"] == b"1"
        assert file["amplitude"].attrs["units"] == b"m"
        assert list(file["frequency"][:]) == [200.0, 260.0]
        assert list(file["model"][:]) == [b"hertz", b"linear"]
        assert np.isnan(response[...]).all()
        assert np.all(file["impacts"][...] == file["impacts"].attrs["_FillValue"])
        assert np.all(file[STATE][...] == PointState.MISSING)
        assert file[STATE].attrs["flag_meanings"] == b"missing done stopped failed filled"
        assert json.loads(file["study_json"][()])["amplitudes_m"] == [5e-6, 20e-6]
        assert file.attrs["Conventions"].startswith(b"CF-")


def test_a_study_file_needs_no_recent_hdf5_version(path):
    with h5py.File(path) as file:
        assert file.id.get_create_plist().get_version()[0] == 0

        def require_plain(name, thing):
            if isinstance(thing, h5py.Dataset):
                assert thing.dtype.kind in "fiuS", name
                assert thing.chunks is None, name

        file.visititems(require_plain)


def test_the_file_records_which_executor_computed_which_point(small, path):
    count = itertools.count()
    _, end = run_into_file(path, small, cancelled=lambda: next(count) >= 0)
    assert end is StudyEnd.CANCELLED
    first = open_study(path)
    run_into_file(path, small)
    results = open_study(path)
    assert len(results.sessions) == 2
    assert "numpy" in json.loads(results.sessions[0].software_json)
    assert results.sessions[1].executor == "2 thread(s)"
    was_done = first.state == PointState.DONE
    np.testing.assert_array_equal(results.values(SESSION), np.where(was_done, 0.0, 1.0))


@pytest.mark.thorough
def test_a_resumed_study_computes_only_missing_points(study, tmp_path, require_equal):
    path = tmp_path / "a.h5"
    make_file(path, study)
    count = itertools.count()
    begun, end = run_into_file(path, study, cancelled=lambda: next(count) >= 3)
    assert end is StudyEnd.CANCELLED
    assert 0 < len(begun) < study.grid.size
    more, end = run_into_file(path, study)
    assert end is StudyEnd.COMPLETE
    assert len(begun) + len(more) == study.grid.size
    require_equal(open_study(path), solve_study(study))


def test_stored_scene_identities_match_the_scenes(small, tmp_path):
    results = solve_study(small, tmp_path / "a.h5")
    kept = [bytes(each).decode() for each in results.arrays[IDENTITY]]
    assert len(set(kept)) == small.grid.size - 4, "a chain's first point is the scene that starts at rest"
    assert kept[0] == scene_identity(small.scene((0,) * 6, REST))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"accuracy": "quick"}, "contains another study: accuracy is standard in the file and quick in"),
        ({"amplitudes_m": [5e-6, 21e-6]}, "is 2e-05 at position 2 in the file and 2.1e-05 at position 2 in"),
        ({"amplitudes_m": [5e-6]}, "amplitudes_m is 2e-05 at position 2 in the file and 5e-06 in"),
        (
            {"specimen": {"model": "gong2025", "damping_time_s": 3e-5}},
            r"specimen.damping_time_s is \S+ in the file and 3e-05 in",
        ),
        ({"duration_s": 0.3, "window_s": 0.2}, "0.2 in the file and 0.3 in the request, window_s is 0.1"),
    ],
)
def test_a_file_of_another_study_is_refused_with_the_differences(small, path, change, said):
    before = path.read_bytes()
    other = Study.model_validate({**small.model_dump(), **change})
    with pytest.raises(StudyError, match=said) as refused:
        solve_study(other, path, ExistingStudy.RESUME)
    assert "request the same study, or" in str(refused.value)
    assert path.read_bytes() == before


@pytest.mark.thorough
def test_a_study_file_has_one_writer_and_can_be_read_meanwhile(small, tmp_path):
    path = tmp_path / "a.h5"
    with FileStore.create(path, small):
        with pytest.raises(StudyError, match="is being written by another run"):
            FileStore(path, small)
        with h5py.File(path, "r") as file:
            assert file[STATE].shape == small.grid.shape
            assert not open_study(path).is_complete
    FileStore(path, small).close()


def test_a_study_starts_even_while_its_file_is_briefly_read(small, path):
    """A reader holds the HDF5 lock for a moment; a study that starts then must wait for its file."""
    reader = h5py.File(path, "r")
    leaving = threading.Timer(0.3, reader.close)
    leaving.start()
    FileStore(path, small).close()
    leaving.join()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "does not exist, or is not a file"),
        *((each, "is not a readable HDF5") for each in (b"", b"text")),
    ],
)
def test_a_file_without_a_study_is_refused_with_a_readable_message(tmp_path, content, said):
    path = tmp_path / "a.h5"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(StudyError, match=said):
        open_study(path)
    with pytest.raises(StudyError, match="is a folder; give the path of a study's file"):
        open_study(tmp_path)


def test_another_kind_of_hdf5_file_and_a_newer_version_are_refused(small, tmp_path):
    other, newer = tmp_path / "other.h5", tmp_path / "newer.h5"
    with h5py.File(other, "w") as file:
        file.attrs["format"] = b"vibench-recording"
    with pytest.raises(StudyError, match="not the file of a study"):
        open_study(other)
    make_file(newer, small)
    with h5py.File(newer, "r+") as file:
        file.attrs["format_version"] = 99
    with pytest.raises(StudyError, match="has format version 99"):
        open_study(newer)


def reverse(file):
    for name in ("response_i", "scene"):
        file[name][...] = file[name][...][..., ::-1]


def replace_column(file):
    kept = file["response_i"][...]
    del file["response_i"]
    file["response_i"] = kept.astype("f4")


def set_values(name, value):
    def change(file):
        file[name][...] = value

    return change


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (reverse, "point 0 has other values than those computed"),
        (set_values("response_ii", 1.25), "point 0 has other values than those computed"),
        (replace_column, "column response_i has another size, type or storage"),
        (lambda file: file.pop("response_ii"), "response_ii"),
        (lambda file: file.attrs.pop("format_version"), "format_version"),
        (set_values("frequency", [260.0, 200.0]), "axis frequency do not match its study"),
        (set_values("motion", -1), "column motion has a value without a meaning"),
        (set_values("response_i", np.nan), "missing in its column response_i"),
        (set_values("state", 7), "states or points that do not exist"),
        (set_values("sessions/n_sessions", 5000), "out of bounds"),
    ],
)
def test_a_changed_study_file_is_refused_with_a_readable_message_and_kept(
    small, solved, tmp_path, change, said
):
    path = tmp_path / "a.h5"
    path.write_bytes(solved)
    with h5py.File(path, "r+") as file:
        change(file)
    before = path.read_bytes()
    for read in (open_study, lambda path: solve_study(small, path, ExistingStudy.RESUME)):
        with pytest.raises(StudyError, match=said):
            read(path)
    assert path.read_bytes() == before


def test_a_missing_folder_of_a_study_is_named_in_the_error(small, tmp_path):
    with pytest.raises(StudyError, match=r"nowhere.*choose another folder"):
        solve_study(small, tmp_path / "nowhere" / "a.h5")


class LoggingDisk:
    """Disk that logs every write and sync."""

    def __init__(self, path):
        self._inner = sole_writer(path)
        self.log = []

    def write(self, offset, data):
        self._inner.write(offset, data)
        self.log.append((offset, data))

    def sync(self):
        self._inner.sync()
        self.log.append(None)

    def close(self):
        self._inner.close()


def images_after_power_cuts(empty, log, luck):
    """Yield disk contents that a power cut may leave: synced data and any part of later writes."""
    safe, loose = bytearray(empty), []
    for entry in [*log, None]:
        if entry is None:
            for _ in range(4):
                image = bytearray(safe)
                for offset, data in loose:
                    if luck.random() < 0.5:
                        image[offset : offset + len(data)] = data
                yield bytes(image)
            for offset, data in loose:
                safe[offset : offset + len(data)] = data
            loose = []
            yield bytes(safe)
        else:
            loose.append(entry)


@pytest.mark.thorough
def test_study_points_reported_as_stored_are_complete_after_a_power_cut(small, path, tmp_path):
    image_path = tmp_path / "image.h5"
    empty = path.read_bytes()
    disks = []

    def opened(of):
        disks.append(LoggingDisk(of))
        return disks[-1]

    executor = ThreadExecutor(1)
    with FileStore(path, small, opened) as store:
        run_study(small, executor, store)
    executor.close()
    truth = open_study(path)
    (disk,) = disks
    seen = set()
    for image in images_after_power_cuts(empty, disk.log, random.Random(1)):
        image_path.write_bytes(image)
        found = open_study(image_path)
        is_done = found.arrays[STATE] != PointState.MISSING
        seen.add(int(np.count_nonzero(is_done)))
        for column in COLUMNS:
            np.testing.assert_array_equal(
                found.arrays[column.name][is_done], truth.arrays[column.name][is_done], column.name
            )
    assert {0, small.grid.size} < seen
