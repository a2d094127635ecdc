"""The journal: contents, interrupted transactions, and concurrent readers."""

import multiprocessing
import os
import sqlite3

import pytest

from vibench.acquisition import RecordingError
from vibench.acquisition.campaign import JournalPointState, ReasonCode, list_recordings, read_journal
from vibench.acquisition.campaign._journal import BenchIdentity, Journal, journal_exists, journal_path
from vibench.acquisition.plan import Point

from .small_campaigns import campaign, dwell

CAMPAIGN = campaign("one", "two", "three")


@pytest.fixture
def journal(bench, tmp_path):
    with Journal.begin(journal_path(tmp_path, "c"), CAMPAIGN, BenchIdentity.of(bench)) as begun:
        yield begun


def states(points):
    return [(point.name, point.state) for point in points]


def test_the_journal_stores_the_plan_and_the_bench(journal, bench):
    path = journal.path
    journal.close()
    with Journal.open(path) as again:
        assert again.campaign == CAMPAIGN
        assert again.bench.differences(BenchIdentity.of(bench)) == ()
        assert [point.measurement for point in again.points()] == list(CAMPAIGN.measurements)
        assert {point.state for point in again.points()} == {JournalPointState.QUEUED}


def test_each_attempt_is_stored_with_its_number_its_file_and_its_reason(journal):
    journal.start("two", "two.h5")
    assert states(journal.points())[1] == ("two", JournalPointState.RUNNING)
    journal.end("two", JournalPointState.FAILED, ReasonCode.DATA_LOST, "a hole")
    journal.start("two", "two.2.h5")
    journal.end("two", JournalPointState.DONE, ReasonCode.CARRIED_OUT, "the plan was carried out")
    point = journal.points()[1]
    assert (point.state, point.attempts, point.file) == (JournalPointState.DONE, 2, "two.2.h5")
    assert point.begun_utc <= point.ended_utc
    with sqlite3.connect(journal.path) as plain:
        kept = plain.execute(
            "SELECT number, file, state, why, reason FROM attempts ORDER BY number"
        ).fetchall()
    plain.close()
    assert kept == [
        (1, "two.h5", "failed", "data_lost", "a hole"),
        (2, "two.2.h5", "done", "carried_out", "the plan was carried out"),
    ]


def test_added_points_follow_the_point_that_requested_them(journal):
    journal.follow_up("one", (Point("between-1", dwell("between-1")), Point("between-2", dwell("between-2"))))
    points = journal.points()
    assert [point.name for point in points] == ["one", "between-1", "between-2", "two", "three"]
    assert [point.added_after for point in points] == ["", "one", "one", "", ""]
    assert points[0].is_followed_up
    assert not points[3].is_followed_up


def test_an_added_point_with_an_existing_name_is_refused(journal):
    with pytest.raises(RecordingError, match="give every added measurement a new name"):
        journal.follow_up("one", (Point("new", dwell("new")), Point("Three", dwell("Three"))))
    assert [point.name for point in journal.points()] == ["one", "two", "three"]
    assert not journal.points()[0].is_followed_up


def _start_and_die(path):
    with Journal.open(path) as journal:
        journal.start("one", "one.h5")
        # The transaction of the next step is open when the process ends.
        journal._connection.execute("BEGIN IMMEDIATE")
        journal._connection.execute("UPDATE points SET state = 'done'")
        os._exit(9)


@pytest.mark.thorough
def test_a_kill_during_a_journal_transaction_keeps_the_previous_state(journal):
    path = journal.path
    journal.close()
    child = multiprocessing.get_context("spawn").Process(target=_start_and_die, args=(path,))
    child.start()
    child.join()
    assert child.exitcode == 9
    assert states(read_journal(path)) == [
        ("one", JournalPointState.RUNNING),
        ("two", JournalPointState.QUEUED),
        ("three", JournalPointState.QUEUED),
    ]


def test_reading_a_journal_while_it_is_written_leaves_no_extra_files(journal, tmp_path):
    journal.start("one", "one.h5")
    assert read_journal(journal.path)[0].state is JournalPointState.RUNNING
    journal.end("one", JournalPointState.DONE, ReasonCode.CARRIED_OUT, "")
    journal.close()
    assert read_journal(journal.path)[0].state is JournalPointState.DONE
    assert [path.name for path in tmp_path.iterdir()] == ["c.campaign.sqlite"]


def test_a_campaign_whose_journal_is_empty_counts_as_not_started(tmp_path):
    path = tmp_path / "c.campaign.sqlite"
    path.touch()
    assert not journal_exists(path)


def test_foreign_files_and_newer_journals_are_refused(journal, tmp_path):
    other = tmp_path / "other.sqlite"
    other.write_text("no database " * 100)
    with pytest.raises(RecordingError, match=r"other\.sqlite"):
        Journal.open(other)
    with sqlite3.connect(journal.path) as plain:
        plain.execute("UPDATE campaign SET value = '99' WHERE key = 'version'")
    plain.close()
    with pytest.raises(RecordingError, match="newer version"):
        Journal.open(journal.path)


@pytest.fixture
def connections(monkeypatch):
    """Return the list of all database connections that are made."""
    made, connect = [], sqlite3.connect
    monkeypatch.setattr(sqlite3, "connect", lambda *at, **how: made.append(connect(*at, **how)) or made[-1])
    return made


def open_and_close(path):
    with Journal.open(path):
        pass


@pytest.mark.parametrize(
    "use", [open_and_close, journal_exists, read_journal, lambda path: list_recordings(path.parent)]
)
def test_a_refused_journal_or_catalogue_file_is_closed(connections, tmp_path, use):
    path = tmp_path / "catalogue.sqlite"
    path.write_text("no database " * 100)
    with pytest.raises(RecordingError) as caught:
        use(path)
    assert "catalogue.sqlite" in str(caught.value)
    assert connections
    for connection in connections:
        with pytest.raises(sqlite3.ProgrammingError, match="closed"):
            connection.execute("SELECT 1")


def test_a_journal_that_already_exists_is_refused_and_the_connection_to_it_is_closed(journal, connections):
    with pytest.raises(RecordingError, match="already exists"):
        Journal.begin(journal.path, CAMPAIGN, journal.bench)
    (connection,) = connections
    with pytest.raises(sqlite3.ProgrammingError, match="closed"):
        connection.execute("SELECT 1")
