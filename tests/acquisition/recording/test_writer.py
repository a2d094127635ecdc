import os
from dataclasses import replace
from threading import Event

import numpy as np
import pytest

from vibench.acquisition import Overload, RecordingError, open_recording
from vibench.acquisition.recording import RecordingState, create_recording

BLOCK = 250


def test_every_24_bit_count_round_trips(tmp_path, make_header, make_block):
    written = []
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        for first in range(0, 4000, BLOCK):
            counts, block = make_block(first, BLOCK)
            written.append(counts)
            writer.append(block)
    truth = np.concatenate(written, axis=1)
    assert [each.name for each in tmp_path.iterdir()] == ["a.h5"]
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.state is RecordingState.COMPLETE
        assert recording.samples == 4000
        assert recording.duration_s == 4.0
        for row, role in enumerate(recording.roles):
            np.testing.assert_array_equal(recording.read_counts(role), truth[row])
        assert recording.check_seal("whole").state.value == "intact"
        step = 5.0 / 2**23
        np.testing.assert_allclose(
            recording.read("m0_velocity"), 0.125 * (truth[1] + 1.5) * step, rtol=1e-13, atol=1e-18
        )


def test_raw_converter_counts_are_recorded_unchanged(tmp_path, make_header, make_block):
    counts, block = make_block(0, BLOCK)
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        writer.append(replace(block, counts=counts))
    with open_recording(tmp_path / "a.h5") as recording:
        assert all(
            np.array_equal(recording.read_counts(role), counts[row])
            for row, role in enumerate(recording.roles)
        )


@pytest.mark.parametrize("spoil", [lambda counts: counts[:, 1:], lambda counts: counts.astype(float)])
def test_counts_of_a_wrong_shape_or_type_are_refused(tmp_path, make_header, make_block, spoil):
    counts, block = make_block(0, BLOCK)
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        with pytest.raises(RecordingError, match=r"they must be int32 and of the same shape"):
            writer.append(replace(block, counts=spoil(counts)))
        assert writer.samples == 0


@pytest.mark.parametrize("taken", ["a.h5", "a.h5.part", "a.h5.tmp"])
def test_a_recording_never_overwrites_an_existing_file(tmp_path, make_header, taken):
    (tmp_path / taken).write_text("precious")
    with pytest.raises(RecordingError, match=rf"{taken} exists"):
        create_recording(tmp_path / "a.h5", make_header())
    assert (tmp_path / taken).read_text() == "precious"


def test_a_recording_never_replaces_a_link_that_leads_nowhere(tmp_path, make_header):
    (tmp_path / "a.h5").symlink_to("/archive/a.h5")
    with pytest.raises(RecordingError, match=r"a\.h5 exists"):
        create_recording(tmp_path / "a.h5", make_header())
    assert (tmp_path / "a.h5").is_symlink()


@pytest.mark.parametrize("name", ["a.hdf5", "a", "a.h5.part"])
def test_a_file_extension_other_than_h5_is_refused(tmp_path, make_header, name):
    with pytest.raises(RecordingError, match=r"NAME\.h5"):
        create_recording(tmp_path / name, make_header())


def test_a_missing_folder_is_named_in_the_error(tmp_path, make_header):
    with pytest.raises(RecordingError, match="nowhere does not exist"):
        create_recording(tmp_path / "nowhere" / "a.h5", make_header())


def test_a_recording_larger_than_the_free_disk_space_is_refused_before_the_start(tmp_path, make_header):
    with pytest.raises(RecordingError, match=r"needs \d+ MB .* the disk has \d+ MB"):
        create_recording(tmp_path / "a.h5", make_header(expected_samples=10**15))
    assert list(tmp_path.iterdir()) == []


def test_lost_samples_leave_a_gap_and_are_read_as_nan(tmp_path, make_header, make_block):
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        writer.append(make_block(0, 100)[1])
        counts, block = make_block(150, 100)
        writer.append(block)
    with open_recording(tmp_path / "a.h5") as recording:
        assert [(gap.first_sample, gap.last_sample) for gap in recording.gaps] == [(100, 149)]
        values = recording.read("m0_velocity")
        assert np.isnan(values[100:150]).all()
        assert not np.isnan(values[:100]).any()
        np.testing.assert_array_equal(recording.read_counts("m0_velocity", 150), counts[1])


def test_a_repeated_block_is_refused(tmp_path, make_header, make_block):
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        writer.append(make_block(0, 100)[1])
        with pytest.raises(RecordingError, match="sample 50 was given, but 100 samples"):
            writer.append(make_block(50, 100)[1])
        assert writer.samples == 100


def test_a_block_of_the_wrong_shape_is_refused(tmp_path, make_header, make_block):
    with (
        create_recording(tmp_path / "a.h5", make_header()) as writer,
        pytest.raises(RecordingError, match=r"must be \(2, samples\)"),
    ):
        writer.append(make_block(0, 100, channels=3)[1])


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="this system claims no room beforehand")
def test_a_recording_may_exceed_its_plan_only_by_the_margin_and_hold_time(tmp_path, make_header, make_block):
    planned, margin, hold = 4000, 10_000, 600_000
    with create_recording(tmp_path / "a.h5", make_header(expected_samples=planned)) as writer:
        claimed = disk_bytes(tmp_path)
        writer.append(make_block(0, planned)[1])
        while writer.committed_samples < planned:
            Event().wait(0.01)
        assert disk_bytes(tmp_path) == claimed, "a plan that is kept to asks the disk for nothing more"
        for first in range(planned, planned + margin + hold, 10_000):
            counts, block = make_block(first, 10_000)
            writer.append(block)
        with pytest.raises(RecordingError, match=r"full.*614000 samples fit"):
            writer.append(make_block(planned + margin + hold, 1)[1])
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.samples == planned + margin + hold
        np.testing.assert_array_equal(recording.read_counts("m0_velocity", 604_000), counts[1])


def disk_bytes(folder):
    return (folder / "a.h5.part").stat().st_blocks * 512


def test_an_open_ended_recording_has_no_fixed_length(tmp_path, make_header, make_block):
    header = make_header(expected_samples=None)
    with create_recording(tmp_path / "a.h5", header) as writer:
        claimed = disk_bytes(tmp_path)
        for first in range(0, 200_000, 10_000):  # 200 s is three times the duration reserved at the start
            counts, block = make_block(first, 10_000)
            writer.append(block)
    assert claimed < 20e6, "a day is declared, but only a minute may be claimed"
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.expected_samples is None
        assert recording.samples == 200_000
        np.testing.assert_array_equal(recording.read_counts("m0_velocity", 190_000), counts[1])


def test_an_exception_ends_a_recording_as_failed_and_the_reason_is_stated(tmp_path, make_header, make_block):
    def measure():
        with create_recording(tmp_path / "a.h5", make_header()) as writer:
            writer.append(make_block(0, BLOCK)[1])
            writer.log("limit", str(1 / 0))

    with pytest.raises(ZeroDivisionError):
        measure()
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.state is RecordingState.FAILED
        assert recording.reason == "ZeroDivisionError: division by zero"
        assert recording.samples == BLOCK


def test_a_keyboard_interrupt_stops_a_recording(tmp_path, make_header):
    with pytest.raises(KeyboardInterrupt), create_recording(tmp_path / "a.h5", make_header()):
        raise KeyboardInterrupt
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.state is RecordingState.STOPPED
        assert recording.samples == 0


def test_a_recording_can_only_end_in_a_final_state(tmp_path, make_header):
    with (
        create_recording(tmp_path / "a.h5", make_header()) as writer,
        pytest.raises(RecordingError, match="complete, stopped, failed"),
    ):
        writer.finish(RecordingState.INTERRUPTED)


def test_events_and_segments_have_sample_positions(tmp_path, make_header, make_block):
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        writer.begin_segment("steady", realisation=3, frequency_hz=260.0, direction="up")
        writer.append(make_block(0, 100)[1])
        writer.end_segment()
        writer.log("ramp", "drive up to 2.5 V, 45 µm gap")
        writer.begin_segment("ramp")
        writer.append(make_block(100, 50)[1])
        writer.finish(RecordingState.STOPPED, "operator")
    with open_recording(tmp_path / "a.h5") as recording:
        steady, ramp = recording.segments
        assert (steady.label, steady.start, steady.stop, steady.is_complete) == ("steady", 0, 100, True)
        assert steady.numbers == {"realisation": 3, "frequency_hz": 260.0, "direction": "up"}
        assert (ramp.start, ramp.stop, ramp.is_complete) == (100, 150, False)
        (event,) = recording.events
        assert (event.sample, event.kind, event.text) == (100, "ramp", "drive up to 2.5 V, 45 µm gap")
        assert (recording.state, recording.reason) == (RecordingState.STOPPED, "operator")


def test_a_segment_cannot_begin_inside_another_segment(tmp_path, make_header):
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        writer.begin_segment("one")
        with pytest.raises(RecordingError, match="'one' is open"):
            writer.begin_segment("two")
        writer.end_segment()
        with pytest.raises(RecordingError, match="No segment is open"):
            writer.end_segment()


def test_numbers_that_json_cannot_store_are_refused(tmp_path, make_header):
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        with pytest.raises(RecordingError, match="'steady' cannot be stored as JSON"):
            writer.begin_segment("steady", frequency_hz=float("nan"))
        writer.begin_segment("steady", frequency_hz=np.float64(260.0), realisation=np.int64(3))
        writer.end_segment()
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.segments[0].numbers == {"frequency_hz": 260.0, "realisation": 3}


def test_an_overload_across_blocks_is_stored_as_one_range(tmp_path, make_header, make_block):
    parts = [(0, 99), (100, 149), (200, 210)]
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        for index, (first, last) in enumerate(parts):
            writer.append(make_block(100 * index, 100, overloads=(Overload("m0_velocity", first, last),))[1])
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.overloads == (Overload("m0_velocity", 0, 149), Overload("m0_velocity", 200, 210))


def test_overloads_beyond_the_table_size_are_merged(tmp_path, make_header, make_block):
    many = tuple(Overload("m0_velocity", 2 * each, 2 * each) for each in range(9000))
    late = (Overload("drive_voltage", 5, 6),)
    with create_recording(tmp_path / "a.h5", make_header(expected_samples=20_000)) as writer:
        writer.append(make_block(0, 18_000, overloads=many)[1])
        writer.append(make_block(18_000, 100, overloads=late)[1])
    with open_recording(tmp_path / "a.h5") as recording:
        marked = np.zeros(18_100, dtype=bool)
        for each in recording.overloads:
            if each.channel == "m0_velocity":
                marked[each.first_sample : each.last_sample + 1] = True
        assert marked[0:18_000:2].all()
        assert late[0] in recording.overloads


def test_events_beyond_the_table_size_are_counted(tmp_path, make_header):
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        for number in range(4100):
            writer.log("note", f"number {number}")
    with open_recording(tmp_path / "a.h5") as recording:
        assert len(recording.events) == 4096
        assert recording.events[-1].text == "5 more events did not fit here"


def test_a_finished_writer_refuses_samples(tmp_path, make_header, make_block):
    writer = create_recording(tmp_path / "a.h5", make_header())
    assert writer.finish(RecordingState.COMPLETE) == tmp_path / "a.h5"
    with pytest.raises(RecordingError, match="is finished"):
        writer.append(make_block(0, 10)[1])
    assert writer.finish(RecordingState.FAILED) == tmp_path / "a.h5"
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.state is RecordingState.COMPLETE
