"""The seal of a recording reveals later changes; each result has a separate seal."""

import hashlib
import hmac
import json
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.recording import (
    RecordingState,
    ResultArray,
    SealDepth,
    SealState,
    _seal,
    create_recording,
    part_of,
    recover,
    seal_key,
)

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "verify_a_recording_with_h5py.py"
KEY = b"a key that nobody else has"


@pytest.fixture
def make_file(tmp_path, make_header, make_block):
    def record(name="a.h5"):
        with create_recording(tmp_path / name, make_header()) as writer:
            writer.begin_segment("dwell", frequency_hz=260.0)
            writer.append(make_block(0, 1000)[1])
            writer.append(make_block(1200, 1300)[1])  # after a gap of 200 samples
            writer.end_segment()
            writer.log("mark", "somebody knocked")
        return tmp_path / name

    return record


@pytest.fixture
def key_file(tmp_path, monkeypatch):
    path = tmp_path / "key"
    path.write_bytes(KEY + b"\n")
    monkeypatch.setenv("VIBENCH_SEAL_KEY", str(path))
    return path


def state_of(path, depth="whole", key=None):
    with open_recording(path) as recording:
        return recording.check_seal(depth, key).state


def run_example(path, *more):
    found = subprocess.run(
        [sys.executable, EXAMPLE, path, *more], capture_output=True, text=True, check=False
    )
    return found.returncode, found.stdout.strip()


@pytest.mark.parametrize("events", [1, 400])
@pytest.mark.parametrize("column", ["text", "sample", "unix_time_s"])
def test_the_quick_check_finds_a_change_in_a_table_of_any_length(tmp_path, make_header, events, column):
    path = tmp_path / "a.h5"
    with create_recording(path, make_header()) as writer:
        for number in range(events):
            writer.log("mark", f"{number}: {'knocked ' * 25}")
    with h5py.File(path, "r+") as file:
        values = file["events"][column][()]
        values[-1] = b"nobody knocked" if column == "text" else values[-1] + 1
        file["events"][column][...] = values
    assert state_of(path, "quick") is state_of(path) is SealState.DAMAGED


@pytest.mark.thorough
def test_h5py_and_hashlib_alone_verify_a_seal(make_file):
    path = make_file()
    assert state_of(path) is state_of(path, "quick") is SealState.INTACT
    with open_recording(path) as recording:
        seal = recording.seal
        assert seal == recording.check_seal(SealDepth.WHOLE).seal
    assert run_example(path) == (0, f"unchanged since it was sealed: {seal}")
    with h5py.File(path, "r+") as file:
        file["m0_velocity"].attrs["delay_s"] = 0.1
    assert run_example(path) == (1, "changed since it was sealed: /m0_velocity")


def test_the_h5py_example_accepts_a_signature_only_with_the_right_key(make_file, key_file):
    path = make_file()
    assert run_example(path, key_file)[0] == 0
    other = key_file.with_name("other")
    other.write_bytes(b"another key, which is wrong")
    assert run_example(path, other) == (1, "not signed with this key")


def change_sample(file):
    file["m0_velocity"][17] += 1


def change_scale(file):
    file["m0_velocity"].attrs["units"] = np.bytes_(b"km/s ")


def change_segment(file):
    file["segments/last_sample"][0] -= 1


def change_time(file):
    file["time"].attrs["scale_factor"] = 0.002


def change_plan(file):
    raw = file["configuration/plan_json"][()].replace(b"260", b"261")
    file["configuration/plan_json"][()] = raw


def change_identity(file):
    file.attrs["recording_id"] = np.bytes_(b"0" * 32)


def change_view(file):
    file["view/m0_velocity/values"][0] += 1


def change_overview(file):
    file["overview/m0_velocity_low"][0] += 1


def add_a_dataset(file):
    file["notes"] = 1


def remove_overview(file):
    del file["overview"]


CHANGES = (
    change_scale, change_segment, change_time, change_plan, change_identity, change_overview, change_view,
    add_a_dataset, remove_overview,
)  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("depth", SealDepth)
def test_the_quick_check_finds_every_change_outside_the_samples(make_file, change, depth):
    path = make_file()
    with h5py.File(path, "r+") as file:
        change(file)
    assert state_of(path, depth) is SealState.DAMAGED


def test_the_full_check_finds_a_changed_sample(make_file):
    path = make_file()
    with h5py.File(path, "r+") as file:
        change_sample(file)
    with open_recording(path) as recording:
        found = recording.check_seal("whole")
    assert (found.state, found.sentence) == (SealState.DAMAGED, "changed since sealing: data of /m0_velocity")


def test_a_changed_manifest_damages_the_seal_and_a_recomputed_digest_gives_another_seal(make_file):
    path = make_file()
    with open_recording(path) as recording:
        before = recording.seal
    with h5py.File(path, "r+") as file:
        manifest = json.loads(file["seal/manifest_json"][()])
        manifest["/"]["data"] = "x"
        text = json.dumps(manifest, sort_keys=True)
        del file["seal/manifest_json"]
        file["seal"].create_dataset("manifest_json", data=np.bytes_(text.encode()))
    assert state_of(path) is SealState.DAMAGED
    with h5py.File(path, "r+") as file:
        file["seal"].attrs["sha256"] = np.bytes_(hashlib.sha256(text.encode()).hexdigest().encode())
    with open_recording(path) as recording:
        assert recording.seal != before


def test_a_recording_without_a_seal_is_reported_as_unsealed(make_file):
    path = make_file()
    with h5py.File(path, "r+") as file:
        del file["seal"]
    with open_recording(path) as recording:
        for depth in SealDepth:
            found = recording.check_seal(depth)
            assert (found.state, recording.seal) == (SealState.SEAL_GONE, "")
            assert "its seal is gone: vibench" in found.sentence
    with h5py.File(path, "r+") as file:
        del file["overview"], file["view"]  # as in a file of a version before seals
    with open_recording(path) as recording:
        found = recording.check_seal("whole")
        assert found.state is SealState.UNSEALED
        assert "before recordings were sealed" in found.sentence


def test_samples_of_an_unsealed_recording_are_checked_by_channel_checksums(make_file):
    path = make_file()
    with h5py.File(path, "r+") as file:
        del file["seal"]
        change_sample(file)
    with open_recording(path) as recording:
        found = recording.check_seal("whole")
    assert found.state is SealState.DAMAGED
    assert found.sentence == "it has no seal, and the samples of m0_velocity do not match their checksum"


@pytest.mark.parametrize("change", ["attribute", "dataset", "all but the group"])
def test_a_seal_with_a_missing_part_is_invalid(make_file, change):
    path = make_file()
    with h5py.File(path, "r+") as file:
        if change != "dataset":
            del file["seal"].attrs["sha256"]
        if change != "attribute":
            del file["seal/manifest_json"]
    assert state_of(path) is state_of(path, "quick") is SealState.DAMAGED


def test_the_seal_of_another_recording_is_refused(make_file):
    path, other = make_file(), make_file("b.h5")
    with h5py.File(path, "r+") as file, h5py.File(other) as source:
        del file["seal"]
        source.copy("seal", file)
    assert state_of(path) is SealState.DAMAGED


def test_a_renamed_finished_recording_is_checked_against_its_seal(make_file):
    path = make_file()
    with h5py.File(path, "r+") as file:
        change_scale(file)
    assert state_of(path.rename(part_of(path))) is SealState.DAMAGED


def test_a_check_with_a_key_fails_if_the_recording_has_no_seal(make_file, key_file):
    path = make_file()
    with h5py.File(path, "r+") as file:
        del file["seal"]
    assert state_of(path, key=seal_key(key_file)) is SealState.OTHER_KEY


def test_recovery_seals_a_recording(tmp_path, make_header, make_block):
    writer = create_recording(tmp_path / "a.h5", make_header())
    writer.append(make_block(0, 2000)[1])
    writer._committer.close()
    writer._disk.close()
    assert state_of(tmp_path / "a.h5.part") is SealState.UNFINISHED
    path = recover(tmp_path / "a.h5.part")
    assert state_of(path) is SealState.INTACT
    assert run_example(path)[0] == 0


def test_the_part_file_is_kept_if_the_finished_copy_is_damaged(make_file, tmp_path, make_header, make_block):
    path = make_file("kept.h5")
    writer = create_recording(tmp_path / "a.h5", make_header())
    writer.append(make_block(0, 2000)[1])
    writer._committer.close()
    part = part_of(tmp_path / "a.h5").read_bytes()
    writer.finish(RecordingState.COMPLETE)
    part_of(tmp_path / "a.h5").write_bytes(part)  # as if the program had ended before it was deleted
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        change_sample(file)
    with pytest.raises(RecordingError, match=r"a.h5 is damaged.*Nothing was changed"):
        recover(tmp_path / "a.h5")
    assert part_of(tmp_path / "a.h5").read_bytes() == part
    assert path.exists()


def test_samples_changed_before_the_end_of_a_recording_are_not_sealed(tmp_path, make_header, make_block):
    writer = create_recording(tmp_path / "a.h5", make_header())
    writer.append(make_block(0, 2000)[1])
    writer._committer.close()
    with h5py.File(tmp_path / "a.h5.part", "r+", locking=False) as file:
        change_sample(file)
    with pytest.raises(RecordingError, match="differ from those recorded"):
        writer.finish(RecordingState.COMPLETE)
    assert [each.name for each in tmp_path.iterdir()] == ["a.h5.part"]


def test_a_seal_is_signed_if_a_key_is_given(make_file, key_file, monkeypatch):
    path = make_file()
    with h5py.File(path) as file:
        manifest, signature = file["seal/manifest_json"][()], file["seal"].attrs["hmac_sha256"]
    assert hmac.new(KEY, manifest, hashlib.sha256).hexdigest().encode() == signature
    assert state_of(path) is SealState.INTACT
    monkeypatch.delenv("VIBENCH_SEAL_KEY")
    with open_recording(path) as recording:
        assert "signed with the key" in recording.check_seal("quick").sentence
        assert recording.check_seal("quick").state is SealState.INTACT
    other = key_file.with_name("other")
    other.write_bytes(b"another key of somebody else")
    assert state_of(path, key=seal_key(other)) is SealState.OTHER_KEY


def test_a_seal_forged_without_the_key_is_detected(make_file, key_file):
    path = make_file()
    with h5py.File(path, "r+") as file:
        change_sample(file)
        manifest = json.loads(file["seal/manifest_json"][()])
        manifest["/m0_velocity"]["data"] = hashlib.sha256(file["m0_velocity"][:].tobytes()).hexdigest()
        text = json.dumps(manifest, sort_keys=True).encode()
        file["seal/manifest_json"][()] = text
        file["seal"].attrs["sha256"] = np.bytes_(hashlib.sha256(text).hexdigest().encode())
    with open_recording(path) as recording:
        found = recording.check_seal("whole")
    assert (found.state, "forged" in found.sentence) == (SealState.DAMAGED, True)
    assert state_of(path, key=seal_key(key_file)) is SealState.DAMAGED


@pytest.mark.parametrize(
    ("content", "said"), [(None, "cannot be read"), (b"short", "has 5 bytes; at least 16")]
)
def test_an_invalid_key_is_refused_before_recording(tmp_path, make_header, monkeypatch, content, said):
    monkeypatch.setenv("VIBENCH_SEAL_KEY", str(tmp_path / "key"))
    if content is not None:
        (tmp_path / "key").write_bytes(content)
    with pytest.raises(RecordingError, match=said):
        create_recording(tmp_path / "a.h5", make_header())
    assert not list(tmp_path.glob("a.h5*"))


@pytest.fixture
def with_result(make_file):
    path = make_file()
    arrays = {"H": ResultArray(np.arange(3.0), "1", ("f",)), "f": ResultArray(np.arange(3.0), "Hz")}
    with open_recording(path) as recording:
        recording.save_results("spectrum", arrays, {"window": "hann"})
    return path


def test_a_result_stored_in_a_recording_has_a_separate_seal(with_result):
    with open_recording(with_result) as recording:
        assert recording.check_seal("whole").state is SealState.INTACT
        assert [each.state for each in recording.check_result_seals().values()] == [SealState.INTACT]
        assert recording.results["spectrum"].arrays["H"].axes == ("f",)


def test_a_changed_result_is_refused_and_the_recording_stays_intact(with_result):
    with h5py.File(with_result, "r+") as file:
        file["results/spectrum/H"][1] = 7.0
    with open_recording(with_result) as recording:
        assert recording.check_seal("whole").state is SealState.INTACT
        assert [each.state for each in recording.check_result_seals().values()] == [SealState.DAMAGED]
        with pytest.raises(RecordingError, match="the result 'spectrum' is damaged"):
            _ = recording.results


def test_a_result_of_another_recording_is_refused(with_result, tmp_path, make_header, make_block):
    with create_recording(tmp_path / "b.h5", make_header()) as writer:
        writer.append(make_block(0, 500)[1])
    with h5py.File(with_result) as source, h5py.File(tmp_path / "b.h5", "r+") as target:
        source.copy("results/spectrum", target["results"])
    with open_recording(tmp_path / "b.h5") as recording:
        assert [each.state for each in recording.check_result_seals().values()] == [SealState.DAMAGED]


def test_a_result_without_its_seal_is_refused(with_result):
    with h5py.File(with_result, "r+") as file:
        del file["results/spectrum"].attrs["seal_sha256"]
    with open_recording(with_result) as recording, pytest.raises(RecordingError, match="its seal is gone"):
        _ = recording.results


def test_an_unsealed_result_of_an_older_version_is_read(with_result):
    with h5py.File(with_result, "r+") as file:
        del file["seal"], file["overview"], file["view"]
        for name in [each for each in file["results/spectrum"].attrs if each.startswith("seal_")]:
            del file["results/spectrum"].attrs[name]
        del file["results/spectrum/H"].attrs["axes_json"]
    with open_recording(with_result) as recording:
        assert recording.results["spectrum"].arrays["H"].axes == ("f",)
        assert [each.state for each in recording.check_result_seals().values()] == [SealState.UNSEALED]


def test_no_result_is_added_to_a_damaged_recording(make_file):
    path = make_file()
    with h5py.File(path, "r+") as file:
        change_time(file)
    before = path.read_bytes()
    with open_recording(path) as recording, pytest.raises(RecordingError, match="nothing was added"):
        recording.save_results("spectrum", {}, {})
    assert path.read_bytes() == before


def test_a_result_that_expands_beyond_the_size_limit_is_not_read(with_result, monkeypatch):
    monkeypatch.setattr(_seal, "LARGEST_TABLE_BYTES", 1000)
    with h5py.File(with_result, "r+") as file:
        del file["results/spectrum/H"]
        file["results/spectrum"].create_dataset("H", shape=(100, 100), dtype="f8", compression="gzip")
    with open_recording(with_result) as recording:
        found = recording.check_result_seals()["spectrum"]
    assert found.state is SealState.DAMAGED
    assert "/results/spectrum/H (8e+04 bytes) is larger than any result" in found.sentence


@pytest.mark.parametrize("what", [np.zeros(3), h5py.SoftLink("/results")])
def test_an_invalid_group_of_results_is_refused_with_a_readable_message(make_file, what):
    path = make_file()
    with h5py.File(path, "r+") as file:
        del file["results"]
        file["results"] = what
    with open_recording(path) as recording:
        assert recording.check_seal("whole").state is SealState.INTACT
        with pytest.raises(RecordingError, match="the results cannot be read"):
            recording.check_result_seals()


class TestChangedAfterTheCheck:
    """A file may change between its check and the analysis: the analysis must read what was checked."""

    @pytest.fixture
    def long(self, tmp_path, make_header, make_block):
        with create_recording(tmp_path / "long.h5", make_header()) as writer:
            writer.append(make_block(0, 2 * _seal.PIECE_ITEMS + 17)[1])
        return tmp_path / "long.h5"

    @staticmethod
    def overwrite(path, change):
        """Overwrite a file in place, as another program could while this program has it open."""
        code = f"import h5py\nwith h5py.File({str(path)!r}, 'r+', locking=False) as file:\n    {change}"
        subprocess.run([sys.executable, "-c", code], check=True)

    def test_samples_changed_after_the_check_are_refused(self, long):
        with open_recording(long) as recording:
            role, at = recording.roles[-1], _seal.PIECE_ITEMS + 5
            before = recording.read_counts(role)
            assert recording.check_seal("whole").state is SealState.INTACT
            assert np.array_equal(recording.read_counts(role), before)
            for start, stop in (
                (0, 0),
                (at - 3, at + 3),
                (_seal.PIECE_ITEMS - 1, 2 * _seal.PIECE_ITEMS + 17),
            ):
                assert np.array_equal(recording.read_counts(role, start, stop), before[start:stop])
        with open_recording(long) as recording:
            self.overwrite(long, f"file[{role!r}][{at}] += 1")
            assert np.array_equal(recording.read_counts(role, 0, at - 1000), before[: at - 1000])
            with pytest.raises(RecordingError, match="were changed after the seal had been checked"):
                recording.read_counts(role, at - 5, at - 4)

    def test_a_reopened_file_must_match_its_earlier_check(self, long):
        with open_recording(long) as recording:
            recording.check_seal("whole")
        self.overwrite(long, f"file[{recording.roles[0]!r}].attrs['delay_s'] = 0.001")
        with pytest.raises(RecordingError, match="was changed after its seal had been checked"):
            open_recording(long)

    def test_the_seal_check_covers_metadata_that_were_read_before_the_check(self, long):
        sound = long.read_bytes()
        self.overwrite(long, "file.attrs['expected_samples'] = 5")
        with open_recording(long) as recording:
            assert recording.expected_samples == 5
            long.write_bytes(sound)
            assert recording.check_seal("quick").state is SealState.DAMAGED
