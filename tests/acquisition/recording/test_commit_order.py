"""A crash between any two writes, and a power cut that keeps any of the unsynced pages."""

import random
from dataclasses import dataclass, field

import numpy as np
import pytest

from acquisition.instruments import Overload
from acquisition.recording import RecordingState, open_recording
from acquisition.recording.disk import PositionedFile
from acquisition.recording.layout import part_of
from acquisition.recording.preallocate import ITEM_BYTES, preallocate
from acquisition.recording.writer import RecordingWriter

BLOCKS, BLOCK = 40, 7
PAGE = 4096


@dataclass
class TracedDisk:
    """A real file that also remembers what was done to it, in order; ``None`` stands for a sync."""

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
    """A recording that commits every batch: its empty file, its trace of writes, its true counts."""
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


def handed_over(places, trace):
    """Samples of the last channel that the trace has written: what the disk has seen at most."""
    base = places.channels[-1]
    ends = [(each[0] - base + len(each[1])) // ITEM_BYTES for each in trace if each and each[0] >= base]
    return max(ends, default=0)


def test_a_crash_after_any_write_opens_and_loses_at_most_one_block(tmp_path, traced):
    places, empty, trace, truth = traced
    crashed = tmp_path / "crashed.h5.part"
    crashed.write_bytes(empty)
    assert len(trace) > 300
    # Replayed write by write: the file is what a crash after each of them leaves.
    with crashed.open("r+b", buffering=0) as file:
        for point, write in enumerate(trace):
            if write is None:
                continue
            file.seek(write[0])
            file.write(write[1])
            with open_recording(crashed) as recording:
                seen = handed_over(places, trace[: point + 1])
                assert seen - BLOCK <= recording.samples <= seen
                for row, role in enumerate(recording.roles):
                    np.testing.assert_array_equal(
                        recording.read_counts(role), truth[row, : recording.samples]
                    )
                assert all(each.stop <= recording.samples for each in recording.segments)
                assert all(each.last_sample < recording.samples for each in recording.overloads)
    assert recording.state is RecordingState.COMPLETE


def test_a_power_cut_never_counts_samples_that_are_not_there(traced):
    places, empty, trace, truth = traced
    chance = random.Random(3)
    for _ in range(400):
        cut = chance.randrange(len(trace))
        last_sync = max((at for at in range(cut) if trace[at] is None), default=0)
        image = bytearray(empty)
        for write in trace[:last_sync]:
            if write is not None:
                image[write[0] : write[0] + len(write[1])] = write[1]
        durable = valid_samples(places, image)
        for page, content in pages_of(trace[last_sync:cut], image).items():
            if chance.random() < 0.5:
                image[page * PAGE : page * PAGE + len(content)] = content
        samples = valid_samples(places, image)
        assert samples >= durable
        for row, base in enumerate(places.channels):
            counts = np.frombuffer(image, "<i4", samples, base)
            np.testing.assert_array_equal(counts, truth[row, :samples])


def test_the_power_cut_model_would_notice_a_counter_that_is_synced_with_its_samples(traced):
    places, empty, trace, truth = traced
    careless = [each for at, each in enumerate(trace) if each is not None or at == len(trace) - 1]
    chance = random.Random(3)
    lies = 0
    for _ in range(100):
        image = bytearray(empty)
        for page, content in pages_of(careless[: chance.randrange(len(careless))], image).items():
            if chance.random() < 0.5:
                image[page * PAGE : page * PAGE + len(content)] = content
        samples = valid_samples(places, image)
        counts = np.frombuffer(image, "<i4", samples, places.channels[-1])
        lies += not np.array_equal(counts, truth[-1, :samples])
    assert lies > 0


def test_nothing_but_data_is_written_after_the_start(traced):
    places, empty, trace, _ = traced
    first_place = min(places.n_valid, places.state, places.reason)
    assert min(each[0] for each in trace if each is not None) >= first_place
    assert max(each[0] + len(each[1]) for each in trace if each is not None) <= len(empty)


def valid_samples(places, image):
    return int.from_bytes(image[places.n_valid : places.n_valid + 8], "little")


def pages_of(writes, image):
    """Pages that the writes would leave in the cache, by number."""
    cached = bytearray(image)
    touched = set()
    for write in writes:
        if write is not None:
            offset, data = write
            cached[offset : offset + len(data)] = data
            touched.update(range(offset // PAGE, (offset + len(data) - 1) // PAGE + 1))
    return {page: bytes(cached[page * PAGE : (page + 1) * PAGE]) for page in sorted(touched)}
