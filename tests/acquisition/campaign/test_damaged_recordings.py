"""A recording that differs from its seal is reported, kept, and measured again."""

import os
import shutil
import sqlite3
import sys

import h5py
import pytest

from vibench.acquisition import open_recording, run_campaign
from vibench.acquisition.campaign import (
    CampaignEventKind,
    ExistingRecordings,
    JournalPointState,
    PointOutcome,
    list_recordings,
    planned_recordings,
    read_journal,
    verify_recordings,
)
from vibench.acquisition.errors import CheckFailed, RecordingError
from vibench.acquisition.plan import Campaign
from vibench.acquisition.recording import RecordingState, SealDepth, SealState, recover
from vibench.acquisition.stopping.stop import Cause, StopRequest, StopSwitch

from .small_campaigns import dwell

NAMES = ("one", "two", "three")
CAMPAIGN = Campaign(name="c", measurements=tuple(dwell(name, 260.0 + n) for n, name in enumerate(NAMES)))


def truncate(folder):
    content = (folder / "two.h5").read_bytes()
    (folder / "two.h5").write_bytes(content[: len(content) // 2])


def empty(folder):
    (folder / "two.h5").write_bytes(b"")


def fill_with_random_bytes(folder):
    (folder / "two.h5").write_bytes(os.urandom(20_000))


def change_one_sample(folder):
    with h5py.File(folder / "two.h5", "r+") as file:
        file["m0_velocity"][100] += 1


def change_the_scale(folder):
    with h5py.File(folder / "two.h5", "r+") as file:
        for name in ("scale_factor", "physical_per_volt"):
            file["m0_velocity"].attrs[name] *= 2.0


def copy_other_point(folder):
    shutil.copy(folder / "three.h5", folder / "two.h5")


def replace_by_an_older_recording(folder):
    """Replace a recording by another intact recording of the same plan."""
    shutil.copy(folder / "older" / "two.h5", folder / "two.h5")


def replace_by_a_folder(folder):
    (folder / "two.h5").unlink()
    (folder / "two.h5").mkdir()


DAMAGES = (
    truncate, empty, fill_with_random_bytes, change_one_sample, change_the_scale, copy_other_point,
    replace_by_an_older_recording, replace_by_a_folder,
)  # fmt: skip


@pytest.fixture(scope="module")
def whole_folder(new_bench, rig, tmp_path_factory):
    folder, other, bench = (
        tmp_path_factory.mktemp("recorded"),
        tmp_path_factory.mktemp("other"),
        new_bench(rig),
    )
    for each in (folder, other):
        run_campaign(bench, CAMPAIGN, each)
    (folder / "older").mkdir()
    shutil.copy(other / "two.h5", folder / "older")
    return folder


@pytest.fixture
def folder(whole_folder, tmp_path):
    """Return copies of the recordings, with their file times, for one test to damage."""
    return shutil.copytree(whole_folder, tmp_path, dirs_exist_ok=True)


def outcomes(point_results):
    return {each.name: (each.outcome, each.path.name) for each in point_results}


@pytest.mark.thorough
@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_recording_is_reported_and_kept_and_its_point_is_measured_again(bench, folder, damage):
    damage(folder)
    assert [each.path for each in verify_recordings(folder) if each.is_bad] == ["two.h5"]
    planned = planned_recordings(CAMPAIGN, folder, ExistingRecordings.RESUME)
    assert [each.is_complete for each in planned] == [True, False, True]
    left = (folder / "two.h5").read_bytes() if (folder / "two.h5").is_file() else None
    said = []
    made = run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME, on_event=said.append)
    assert outcomes(made) == {
        "one": (PointOutcome.KEPT, "one.h5"),
        "two": (PointOutcome.RECORDED, "two.2.h5"),
        "three": (PointOutcome.KEPT, "three.h5"),
    }
    (event,) = (each for each in said if each.kind is CampaignEventKind.DAMAGED)
    assert event.text.startswith("two is measured again: ")
    assert "two.h5" in event.text
    assert event.facts["why"] == "damaged"
    assert left is None or (folder / "two.h5").read_bytes() == left
    again = run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME)
    assert {outcome for outcome, _ in outcomes(again).values()} == {PointOutcome.KEPT}


@pytest.mark.thorough
@pytest.mark.parametrize("existing", ExistingRecordings)
def test_a_link_to_a_disk_that_is_not_connected_is_kept(bench, folder, existing):
    link = folder / "one.h5"
    link.unlink()
    link.symlink_to("/archive/one.h5")
    for each in ("two.h5", "three.h5", "c.campaign.sqlite"):
        (folder / each).unlink()
    if existing is ExistingRecordings.REFUSE:
        with pytest.raises(RecordingError, match=r"one\.h5 exists already"):
            run_campaign(bench, CAMPAIGN, folder, existing)
    else:
        made = run_campaign(bench, CAMPAIGN, folder, existing)
        assert outcomes(made)["one"] == (PointOutcome.RECORDED, "one.2.h5")
    assert link.is_symlink()


@pytest.mark.thorough
@pytest.mark.parametrize("damage", [truncate, change_one_sample, replace_by_a_folder])
def test_a_campaign_that_lost_its_journal_does_not_accept_damaged_recordings(bench, folder, damage):
    damage(folder)
    (folder / "c.campaign.sqlite").unlink()
    made = run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME)
    assert outcomes(made)["two"] == (PointOutcome.RECORDED, "two.2.h5")
    assert outcomes(made)["one"] == (PointOutcome.KEPT, "one.h5")


@pytest.mark.thorough
@pytest.mark.parametrize("has_journal", [True, False])
def test_a_stop_ends_the_check_of_the_folder_and_a_resume_repeats_the_check(bench, folder, has_journal):
    """The check of hundreds of recordings must notice a stop before it has read them all."""
    change_one_sample(folder)
    journal = folder / "c.campaign.sqlite"
    if not has_journal:
        journal.unlink()
    switch = StopSwitch()
    switch.ask(StopRequest.of(Cause.OPERATOR, "not today"))
    assert run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME, switch=switch) == ()
    if has_journal:
        assert [each.state for each in read_journal(journal)] == [JournalPointState.DONE] * 3
    made = run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME)
    assert outcomes(made)["two"] == (PointOutcome.RECORDED, "two.2.h5")


@pytest.mark.parametrize("damage", [truncate, empty, fill_with_random_bytes, change_the_scale])
def test_the_catalogue_lists_a_damaged_recording_as_bad(folder, damage):
    assert {each.verdict for each in list_recordings(folder)} == {"samples not checked"}
    damage(folder)
    (bad,) = (each for each in list_recordings(folder) if each.is_bad)
    assert bad.path == "two.h5"
    assert bad.verdict.startswith(("damaged", "cannot be read"))


def test_the_catalogue_detects_a_change_even_if_the_file_time_was_restored(folder):
    list_recordings(folder)
    path = folder / "two.h5"
    before = path.stat()
    content = path.read_bytes()
    assert content.count(b"m s-2") > 0
    with path.open("r+b") as file:
        file.write(content.replace(b"m s-2", b"m s-3"))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_size == before.st_size
    assert [each.path for each in list_recordings(folder) if each.is_bad] == ["two.h5"]


def test_a_campaign_whose_older_journal_has_no_seals_can_be_resumed(bench, folder):
    connection = sqlite3.connect(folder / "c.campaign.sqlite")
    for table in ("points", "attempts"):
        connection.execute(f"ALTER TABLE {table} DROP COLUMN seal")
    connection.execute("UPDATE campaign SET value = '1' WHERE key = 'version'")
    connection.execute("UPDATE points SET state = 'queued', file = '' WHERE name = 'three'")
    connection.commit()
    connection.close()
    assert {each.seal for each in read_journal(folder / "c.campaign.sqlite")} == {""}
    made = run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME)
    assert outcomes(made) == {
        "one": (PointOutcome.KEPT, "one.h5"),
        "two": (PointOutcome.KEPT, "two.h5"),
        "three": (PointOutcome.RECORDED, "three.2.h5"),
    }
    one, _, three = read_journal(folder / "c.campaign.sqlite")
    assert (one.seal, len(three.seal)) == ("", 64)


@pytest.mark.thorough
def test_unsealed_recordings_of_an_older_version_are_kept_and_reported(bench, folder):
    (folder / "c.campaign.sqlite").unlink()
    for path in folder.glob("*.h5"):
        with h5py.File(path, "r+") as file:
            del file["seal"], file["overview"], file["view"]
    made = run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME)
    assert {each.outcome for each in made} == {PointOutcome.KEPT}
    own = [each for each in verify_recordings(folder) if "/" not in each.path]
    assert {(each.verdict, each.is_bad) for each in own} == {("unsealed", False)}
    assert {each.verdict for each in list_recordings(folder) if "/" not in each.path} == {"no seal"}


@pytest.mark.thorough
def test_points_are_measured_again_if_the_seals_of_their_recordings_were_removed(bench, folder):
    (folder / "c.campaign.sqlite").unlink()
    for path in folder.glob("*.h5"):
        with h5py.File(path, "r+") as file:
            del file["seal"]
    assert {each.verdict for each in verify_recordings(folder) if each.is_bad} == {"seal_gone"}
    made = run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME)
    assert {each.outcome for each in made} == {PointOutcome.RECORDED}


@pytest.mark.thorough
def test_every_seal_check_detects_a_swapped_recording(folder):
    shutil.copy(folder / "one.h5", folder / "two.h5")
    with open_recording(folder / "two.h5") as recording:
        for depth in SealDepth:
            found = recording.check_seal(depth)
            assert found.state is SealState.DAMAGED
            assert found.sentence.endswith("of two in the campaign's journal: it is another recording")
        assert not recording.is_checked
    assert [(each.path, each.verdict) for each in verify_recordings(folder) if each.is_bad] == [
        ("two.h5", "damaged")
    ]
    assert [each.path for each in list_recordings(folder) if each.is_bad] == ["two.h5"]


def change_journal(statement):
    def damage(folder):
        connection = sqlite3.connect(folder / "c.campaign.sqlite")
        connection.execute("PRAGMA ignore_check_constraints = 1")
        connection.execute(statement)
        connection.commit()
        connection.close()

    return damage


@pytest.mark.thorough
@pytest.mark.parametrize("table", ["points", "attempts"])
@pytest.mark.parametrize("seal", ["(SELECT seal FROM points WHERE name = 'one')", "''"])
def test_a_journal_with_two_different_seals_for_one_recording_is_reported_as_damage(folder, table, seal):
    list_recordings(folder)
    change_journal(f"UPDATE {table} SET seal = {seal} WHERE name = 'two'")(folder)
    if (table, seal) == ("attempts", "''"):  # as in a journal written before seals existed
        assert not [each for each in verify_recordings(folder) if each.is_bad]
        return
    with open_recording(folder / "two.h5") as recording:
        for depth in SealDepth:
            found = recording.check_seal(depth)
            assert found.state is SealState.DAMAGED
            assert found.sentence == "the campaign's journal has two seals for two: the journal was changed"
        assert not recording.is_checked
    assert [each.path for each in verify_recordings(folder) if each.is_bad] == ["two.h5"]
    assert [each.path for each in list_recordings(folder) if each.is_bad] == ["two.h5"]


@pytest.mark.thorough
def test_a_recording_moved_back_after_its_point_was_repeated_is_reported_as_bad(bench, folder):
    former = (folder / "two.h5").read_bytes()
    (folder / "two.h5").unlink()
    run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME)
    assert not [each for each in verify_recordings(folder) if each.is_bad]
    (folder / "two.h5").write_bytes(former)
    assert [each.path for each in verify_recordings(folder) if each.is_bad] == ["two.h5"]


@pytest.mark.parametrize(
    "damage",
    [
        change_journal("UPDATE points SET file = '../older/two.h5', state = 'running' WHERE name = 'two'"),
        change_journal("UPDATE points SET file = '/etc/two.h5' WHERE name = 'two'"),
        change_journal("UPDATE points SET file = hex(zeroblob(4000)) || '.h5' WHERE name = 'two'"),
        change_journal("UPDATE points SET file = x'ff' WHERE name = 'two'"),
        change_journal("UPDATE points SET state = 'lost' WHERE name = 'two'"),
        change_journal("UPDATE points SET measurement_json = '{}' WHERE name = 'two'"),
        change_journal("UPDATE campaign SET value = 'x' WHERE key = 'version'"),
        change_journal("UPDATE campaign SET value = 'x' WHERE key = 'plan_json'"),
        change_journal("UPDATE benches SET identity_json = 'x'"),
        change_journal("DELETE FROM benches"),
        change_journal("ALTER TABLE points RENAME COLUMN file TO fine"),
    ],
)
def test_an_inconsistent_journal_is_refused_with_a_readable_message(bench, folder, damage):
    damage(folder)
    older = sorted((folder / "older").iterdir())
    with pytest.raises(RecordingError, match=r"c\.campaign\.sqlite has invalid contents"):
        run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME)
    assert sorted((folder / "older").iterdir()) == older


@pytest.mark.timeout(30)
@pytest.mark.skipif(sys.platform == "win32", reason="pipes as POSIX has them")
def test_a_pipe_in_place_of_a_journal_does_not_block(folder):
    (folder / "c.campaign.sqlite").unlink()
    os.mkfifo(folder / "c.campaign.sqlite")
    with pytest.raises(RecordingError, match="is not a file"):
        read_journal(folder / "c.campaign.sqlite")
    with pytest.raises(RecordingError, match="is a folder; give the path of a campaign's journal"):
        read_journal(folder)


def test_the_verification_of_a_folder_names_a_journal_that_cannot_be_read(folder):
    change_journal("UPDATE points SET measurement_json = '{}'")(folder)
    bad = [each for each in verify_recordings(folder) if each.is_bad]
    assert [(each.path, each.verdict) for each in bad] == [("c.campaign.sqlite", "unreadable")]


def test_verifying_an_emptied_folder_reports_missing_recordings(folder):
    for path in folder.glob("*.h5"):
        path.unlink()
    bad = {each.path: each.verdict for each in verify_recordings(folder) if each.is_bad}
    assert bad == dict.fromkeys(("one.h5", "two.h5", "three.h5"), "missing")


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform != "linux", reason="names of any bytes, as Linux has them")
def test_undecodable_file_names_and_circular_links_do_not_prevent_a_listing(folder):
    shutil.copy(folder / "two.h5", os.fsdecode(os.fsencode(folder) + b"/\xff.h5"))
    (folder / "circle.h5").symlink_to("circle.h5")
    listed = {each.path: each.is_bad for each in list_recordings(folder) if "/" not in each.path}
    assert listed == {
        "one.h5": False, "two.h5": False, "three.h5": False, "\ufffd.h5": False, "circle.h5": True,
    }  # fmt: skip
    assert {each.path for each in verify_recordings(folder) if each.is_bad} == {"circle.h5"}


RENAMED = CAMPAIGN.model_copy(update={"name": "d"})


def test_a_renamed_campaign_ignores_recordings_that_its_old_journal_rejects(bench, folder):
    replace_by_an_older_recording(folder)
    made = run_campaign(bench, RENAMED, folder, ExistingRecordings.RESUME)
    assert outcomes(made)["two"] == (PointOutcome.RECORDED, "two.2.h5")
    assert outcomes(made)["one"] == (PointOutcome.KEPT, "one.h5")


def test_if_no_journal_exists_recordings_of_another_bench_are_kept_only_with_consent(new_bench, rig, folder):
    other = new_bench(rig.model_copy(update={"name": "another bench"}))
    with pytest.raises(CheckFailed, match=r"name was .* and is now 'another bench'"):
        run_campaign(other, RENAMED, folder, ExistingRecordings.RESUME)
    made = run_campaign(other, RENAMED, folder, ExistingRecordings.RESUME, changed_bench="accept")
    assert {each.outcome for each in made} == {PointOutcome.KEPT}


def run_until_disk_refuses(bench, folder, stop):
    """Run the campaign until ``two`` cannot be finished on disk; ``stop`` may end the recording early."""
    switch = StopSwitch()

    def refuse(stand):
        if stand.name == "two":
            (folder / "two.h5.tmp").mkdir(exist_ok=True)
            if stop:
                switch.ask(stop)

    with pytest.raises(RecordingError, match=r"two\.h5 could not be written"):
        run_campaign(bench, CAMPAIGN, folder, switch=switch, on_progress=refuse)
    assert (folder / "two.h5.part").exists()


@pytest.mark.thorough
@pytest.mark.parametrize("has_journal", [True, False])
def test_a_stopped_recording_left_unfinished_on_disk_is_recovered_later(bench, tmp_path, has_journal):
    run_until_disk_refuses(bench, tmp_path, StopRequest.of(Cause.OPERATOR, "enough"))
    made = run_campaign(bench, CAMPAIGN, tmp_path, ExistingRecordings.RESUME)
    assert outcomes(made)["two"] == (PointOutcome.RECORDED, "two.2.h5")
    assert (tmp_path / "two.h5.part").exists()
    (tmp_path / "two.h5.tmp").rmdir()
    if not has_journal:
        (tmp_path / "c.campaign.sqlite").unlink()
    made = run_campaign(bench, CAMPAIGN, tmp_path, ExistingRecordings.RESUME)
    assert outcomes(made)["two"] == (PointOutcome.KEPT, "two.2.h5")
    with open_recording(tmp_path / "two.h5") as recording:
        assert recording.state is RecordingState.STOPPED
        assert recording.samples > 0
    assert list(tmp_path.glob("*.part")) == []


@pytest.mark.thorough
@pytest.mark.parametrize("has_journal", [True, False])
def test_a_complete_recording_whose_file_is_unfinished_is_not_repeated(bench, tmp_path, has_journal):
    run_until_disk_refuses(bench, tmp_path, None)
    if not has_journal:
        (tmp_path / "c.campaign.sqlite").unlink()
    with pytest.raises(RecordingError, match=r"two\.h5"):
        run_campaign(bench, CAMPAIGN, tmp_path, ExistingRecordings.RESUME)
    (tmp_path / "two.h5.tmp").rmdir()
    made = run_campaign(bench, CAMPAIGN, tmp_path, ExistingRecordings.RESUME)
    assert outcomes(made)["two"] == (PointOutcome.KEPT, "two.h5")
    assert sorted(each.name for each in tmp_path.glob("*.h5*")) == ["one.h5", "three.h5", "two.h5"]


@pytest.mark.thorough
def test_a_complete_recording_counts_even_if_the_journal_lists_it_as_failed(bench, tmp_path):
    """The journal may lag behind a recovery, or the user has recovered the recording by hand."""
    run_until_disk_refuses(bench, tmp_path, None)
    (tmp_path / "two.h5.tmp").rmdir()
    recover(tmp_path / "two.h5.part")
    failed = read_journal(tmp_path / "c.campaign.sqlite")[1]
    assert (failed.state, failed.file) == (JournalPointState.FAILED, "two.h5")
    planned = planned_recordings(CAMPAIGN, tmp_path, ExistingRecordings.RESUME)
    assert [each.is_complete for each in planned] == [True, True, False]
    made = run_campaign(bench, CAMPAIGN, tmp_path, ExistingRecordings.RESUME)
    assert outcomes(made)["two"] == (PointOutcome.KEPT, "two.h5")
    assert sorted(each.name for each in tmp_path.glob("*.h5*")) == ["one.h5", "three.h5", "two.h5"]


@pytest.mark.thorough
def test_the_point_of_a_recording_moved_back_into_the_folder_is_not_measured_again(bench, folder):
    (folder / "two.h5").rename(folder / "two.away")
    with pytest.raises(RecordingError, match="gone"):
        run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME, on_event=leave)
    (folder / "two.away").rename(folder / "two.h5")
    made = run_campaign(bench, CAMPAIGN, folder, ExistingRecordings.RESUME)
    assert outcomes(made)["two"] == (PointOutcome.KEPT, "two.h5")


def leave(event):
    """End the campaign as soon as the folder has been checked."""
    raise RecordingError("the folder is gone")
