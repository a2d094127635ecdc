"""A recording survives a crash between any two writes, and a power cut that loses any unsynced writes."""

import hashlib
import os
from contextlib import closing, nullcontext
from dataclasses import dataclass, field
from itertools import chain, combinations, pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings, strategies as st

from vibench.acquisition import Overload, RecordingError, open_recording
from vibench.acquisition.recording import RecordingState, RecordingWriter, part_of
from vibench.acquisition.recording._disk import PositionedFile
from vibench.acquisition.recording._preallocate import ITEM_BYTES, preallocate

BLOCKS, BLOCK = 40, 7
PAGE = 4096
SECTOR = 512
"""Number of bytes that a disk writes as a whole."""


@dataclass
class TracedDisk:
    """A real file that also records all writes in order; ``None`` stands for a sync."""

    file: PositionedFile
    trace: list = field(default_factory=list)

    def write(self, offset, data):
        self.trace.append((offset, bytes(data)))
        self.file.write(offset, data)

    def sync(self):
        self.trace.append(None)

    def reserve(self, offset, size):
        self.file.reserve(offset, size)

    def close(self):
        self.file.close()


@pytest.fixture
def traced(tmp_path, make_header, make_block):
    """Return places, empty file, list of writes and true counts of a recording that commits every batch."""
    path = tmp_path / "a.h5"
    header = make_header(expected_samples=BLOCKS * BLOCK, sample_rate_hz=20.0)
    places = preallocate(path, part_of(path), header)
    empty = part_of(path).read_bytes()
    disk = TracedDisk(PositionedFile(part_of(path)))
    writer = RecordingWriter(path, header, places, disk, commit_interval_s=0.0)
    written = []
    for index in range(BLOCKS):
        overloads = (Overload("m0_velocity", BLOCK * index, BLOCK * index + 2),) if index % 5 == 0 else ()
        if index % 4 == 0:
            writer.begin_segment(f"segment {index}", realisation=index)
        counts, block = make_block(BLOCK * index, BLOCK, overloads=overloads)
        written.append(counts)
        writer.append(block)
        if index % 4 == 3:
            writer.end_segment()
    writer.finish(RecordingState.COMPLETE, "done")
    return places, empty, disk.trace, np.concatenate(written, axis=1)


def written_samples(places, trace):
    """Return the number of samples of the last channel that the trace has written."""
    base = places.channels[-1]
    ends = [(each[0] - base + len(each[1])) // ITEM_BYTES for each in trace if each and each[0] >= base]
    return max(ends, default=0)


@pytest.mark.thorough
def test_a_crash_after_any_write_loses_at_most_one_block(tmp_path, traced):
    places, empty, trace, truth = traced
    crashed = tmp_path / "crashed.h5.part"
    crashed.write_bytes(empty)
    assert len(trace) > 300
    # After each replayed write, the file is what a crash at that moment would leave.
    with crashed.open("r+b", buffering=0) as file:
        for point, write in enumerate(trace):
            if write is None:
                continue
            file.seek(write[0])
            file.write(write[1])
            with open_recording(crashed) as recording:
                seen = written_samples(places, trace[: point + 1])
                assert seen - BLOCK <= recording.samples <= seen
                for row, role in enumerate(recording.roles):
                    np.testing.assert_array_equal(
                        recording.read_counts(role), truth[row, : recording.samples]
                    )
                assert all(each.stop <= recording.samples for each in recording.segments)
                assert all(each.last_sample < recording.samples for each in recording.overloads)
    assert recording.state is RecordingState.COMPLETE


class CutFile:
    """A file for trying power cuts one after another, each starting from the empty recording."""

    def __init__(self, path, empty):
        path.write_bytes(empty)
        self.path = path
        self._empty = empty
        self._file = path.open("r+b", buffering=0)
        self._touched = []

    def apply(self, writes):
        for offset, data in writes:
            self._file.seek(offset)
            self._file.write(data)
            self._touched.append((offset, len(data)))

    def clear(self):
        for offset, size in self._touched:
            self._file.seek(offset)
            self._file.write(self._empty[offset : offset + size])
        self._touched.clear()

    def close(self):
        self._file.close()


def sectors_of(write):
    """Divide a write into the pieces that a power cut keeps or loses as a whole."""
    offset, data = write
    edges = [offset, *range((offset // SECTOR + 1) * SECTOR, offset + len(data), SECTOR), offset + len(data)]
    return [(begin, data[begin - offset : end - offset]) for begin, end in pairwise(edges)]


@pytest.mark.thorough
@pytest.mark.parametrize("has_syncs", [True, False])
def test_only_synced_recordings_always_open_after_a_power_cut(tmp_path, traced, has_syncs):
    places, empty, trace, truth = traced
    trace = [each for each in trace if has_syncs or each is not None]
    cut_file = CutFile(tmp_path / "cut.h5.part", empty)

    @settings(
        max_examples=80,
        deadline=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate],
        report_multiple_bugs=False,
    )
    @given(st.data())
    def survives(data):
        cut = data.draw(st.integers(0, len(trace)), label="operations before the cut")
        last_sync = max((at for at in range(cut) if trace[at] is None), default=0)
        synced = [write for write in trace[:last_sync] if write is not None]
        pending = [
            piece for write in trace[last_sync:cut] if write is not None for piece in sectors_of(write)
        ]
        keep = data.draw(st.lists(st.booleans(), min_size=len(pending), max_size=len(pending)), label="kept")
        order = data.draw(st.permutations(range(len(pending))), label="order of the disk")
        cut_file.clear()
        cut_file.apply(synced)
        with open_recording(cut_file.path) as recording:
            durable = recording.samples
        cut_file.apply(pending[index] for index in order if keep[index])
        with open_recording(cut_file.path) as recording:
            require_truth(recording, truth)
            assert recording.samples >= durable
            assert recording.samples >= written_samples(places, synced) - BLOCK

    with closing(cut_file), nullcontext() if has_syncs else pytest.raises((AssertionError, RecordingError)):
        survives()


def require_truth(recording, truth):
    """Require that all contents of the file are true: samples, segments, overloads, and its end."""
    for row, role in enumerate(recording.roles):
        np.testing.assert_array_equal(recording.read_counts(role), truth[row, : recording.samples])
    for number, segment in enumerate(recording.segments):
        assert segment.label == f"segment {4 * number}"
        assert segment.stop <= recording.samples
        assert segment.numbers == {"realisation": 4 * number}
    for number, overload in enumerate(recording.overloads):
        assert (overload.channel, overload.first_sample) == ("m0_velocity", 5 * BLOCK * number)
    if recording.state is RecordingState.COMPLETE:
        assert (recording.reason, recording.samples) == ("done", BLOCKS * BLOCK)


def test_no_hdf5_structure_of_the_file_is_written_after_the_start(traced):
    places, empty, trace, _ = traced
    first_place = min(places.n_valid, places.state, places.reason)
    assert min(each[0] for each in trace if each is not None) >= first_place
    assert max(each[0] + len(each[1]) for each in trace if each is not None) <= len(empty)


@dataclass
class TracedFolder:
    """Records renames and removals in a folder, and syncs of its files and of the folder."""

    folder: object
    operations: list = field(default_factory=list)

    def watch(self, monkeypatch):
        replace, unlink, fsync = os.replace, os.unlink, os.fsync

        def traced_replace(source, target):
            self.operations.append(("rename", Path(source).name, Path(target).name))
            replace(source, target)

        def traced_unlink(path, **where):
            self.operations.append(("unlink", Path(path).name))
            unlink(path, **where)

        def traced_fsync(descriptor):
            fsync(descriptor)
            number = os.fstat(descriptor).st_ino
            names = {each.stat().st_ino: each for each in self.folder.iterdir()}
            if number in names:
                digest = hashlib.sha256(names[number].read_bytes()).hexdigest()
                self.operations.append(("sync file", names[number].name, digest))
            else:
                self.operations.append(("sync folder",))

        monkeypatch.setattr(os, "replace", traced_replace)
        monkeypatch.setattr(os, "unlink", traced_unlink)
        monkeypatch.setattr(os, "fsync", traced_fsync)


@pytest.mark.skipif(not hasattr(os, "fdatasync"), reason="folders are synced on POSIX only")
def test_a_power_cut_during_finishing_keeps_the_whole_recording(
    tmp_path, make_header, make_block, monkeypatch
):
    path = tmp_path / "a.h5"
    places = preallocate(path, part_of(path), make_header())
    writer = RecordingWriter(path, make_header(), places, PositionedFile(part_of(path)))
    writer.append(make_block(0, 4000)[1])
    folder = TracedFolder(tmp_path)
    folder.watch(monkeypatch)
    writer.finish(RecordingState.COMPLETE)
    monkeypatch.undo()
    whole = hashlib.sha256(path.read_bytes()).hexdigest()
    kinds = [operation[0] for operation in folder.operations]
    assert kinds.count("rename") == 1
    assert kinds.count("unlink") == 1
    for cut in range(len(folder.operations) + 1):
        done = folder.operations[:cut]
        synced = max((at for at, each in enumerate(done) if each == ("sync folder",)), default=-1)
        certain = [each for each in done[: synced + 1] if each[0] in ("rename", "unlink")]
        open_ones = [each for each in done[synced + 1 :] if each[0] in ("rename", "unlink")]
        durable = {each[1]: each[2] for each in done if each[0] == "sync file"}
        for survivors in chain.from_iterable(
            combinations(open_ones, number) for number in range(len(open_ones) + 1)
        ):
            names = names_after([*certain, *survivors], durable)
            assert "a.h5.part" in names or names.get("a.h5") == whole


def names_after(operations, durable):
    """Return the names in a folder after these operations, with the durable content of each."""
    names = {"a.h5.part": None, "a.h5.tmp": durable.get("a.h5.tmp")}
    for kind, *operands in operations:
        if kind == "rename":
            names[operands[1]] = names.pop(operands[0], None)
        else:
            names.pop(operands[0], None)
    return names
