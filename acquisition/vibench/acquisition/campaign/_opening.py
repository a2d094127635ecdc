"""Start or resume a campaign: check plan, bench and folder, find kept recordings, and open the journal.

Every attempt at a point has a separate file (``NAME.h5``, ``NAME.2.h5``, ...), never overwritten. After a
crash, journal and folder are compared to find the state of the point that was running.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..bench import Bench
from ..errors import CheckFailed, LimitExceeded, RecordingError
from ..host.printable import leading
from ..plan import Campaign, LimitCheck, Measurement, Point, distinct_drives, require_within_limits
from ..recording import (
    SUFFIX,
    Recording,
    RecordingState,
    SealDepth,
    SealState,
    open_recording,
    part_of,
    recover,
    tmp_of,
)
from ..rig import Rig
from ..run.drive import drive_for
from ..stopping.stop import StopSwitch
from ._journal import (
    BenchIdentity,
    ChangedBench,
    ExistingRecordings,
    Journal,
    JournalPointState,
    PlannedRecording,
    ReasonCode,
    differences,
    journal_exists,
    journal_path,
    read_journal,
)

PROGRAM_ENDED = "the program ended during the recording"


@dataclass(frozen=True)
class KeptRecording:
    """State of the recording of one attempt at a point, as read from its file."""

    path: Path
    state: RecordingState | None
    """State of the recording; None if the file cannot be read."""
    reason: str
    duration_s: float
    seal: str
    damage: str
    """Description of the damage; empty if the file is sound or has no seal."""
    is_of_this_plan: bool
    rig: Mapping[str, Any] = field(default_factory=dict)
    """Configuration of the bench on which the recording was made."""

    @property
    def is_complete(self) -> bool:
        """Whether the recording is undamaged and its run ended as planned."""
        return self.state is RecordingState.COMPLETE and not self.damage


def read_attempt(path: Path, measurement: Measurement, depth: SealDepth) -> KeptRecording:
    """Return the state of the recording at ``path``, and whether its plan equals ``measurement``."""
    try:
        with open_recording(path) as recording:
            found = recording.check_seal(depth)
            is_made = is_made_by(recording, measurement)
            is_damaged = found.state in (SealState.DAMAGED, SealState.SEAL_GONE)
            damage = f"{path.name} is damaged ({found.sentence})" if is_damaged else ""
            return KeptRecording(
                path,
                recording.state,
                recording.reason,
                recording.duration_s,
                found.seal,
                damage,
                is_made,
                recording.bench,
            )
    except RecordingError as error:
        return KeptRecording(path, None, "", 0.0, "", str(error), is_of_this_plan=False)


def is_made_by(recording: Recording, measurement: Measurement) -> bool:
    """Return whether the plan of a recording, as read by this version of vibench, equals ``measurement``."""
    try:
        return Measurement.model_validate(recording.plan) == measurement
    except ValidationError:
        return False


def attempts_in(folder: Path, name: str) -> tuple[Path, ...]:
    """Return the paths of all recordings of a point, finished or not, in the order of the attempts."""
    attempts: list[Path] = []
    while _is_taken(candidate := _attempt(folder, name, len(attempts) + 1)):
        attempts.append(candidate)
    return tuple(attempts)


def next_attempt(folder: Path, name: str) -> Path:
    """Return the path for the next recording of the point ``name``."""
    return _attempt(folder, name, len(attempts_in(folder, name)) + 1)


def complete_attempt(
    folder: Path, name: str, measurement: Measurement, depth: SealDepth
) -> KeptRecording | None:
    """Return the complete recording of a point, else the last damaged recording, else None.

    Raises RecordingError when a recording is complete but was measured with another plan.
    """
    damaged: KeptRecording | None = None
    for path in attempts_in(folder, name):
        if not path.exists():
            continue
        found = read_attempt(path, measurement, depth)
        if found.damage:
            damaged = found
        if not found.is_complete:
            continue
        if not found.is_of_this_plan:
            raise RecordingError(
                f"{path} is a complete recording, but the campaign has another plan for {name!r}. "
                "Nothing was recorded; give the measurement another name, or choose another folder"
            )
        return found
    return damaged


def _attempt(folder: Path, name: str, number: int) -> Path:
    # A dot precedes the number of an attempt. Point names contain no dot, so each file belongs to one point.
    return folder / (f"{name}{SUFFIX}" if number == 1 else f"{name}.{number}{SUFFIX}")


def _is_taken(path: Path) -> bool:
    return any(each.exists() or each.is_symlink() for each in (path, part_of(path), tmp_of(path)))


def reconcile(journal: Journal, folder: Path, stop: StopSwitch) -> None:
    """Update a resumed journal from the files in its folder.

    A point with a complete recording becomes "done", even if the last entry in the journal is missing. A
    "running" point without a complete recording becomes "interrupted", and its unfinished recording is made
    readable. A "done" point is queued again when its recording is missing or differs from its seal; a damaged
    file is kept, and the next attempt gets a new file. Reading a folder may take minutes. After a stop
    request, the remaining points are left for the next resume.
    """
    for point in journal.points():
        if stop.request is not None:
            return
        path = folder / point.file
        has_part = part_of(path).exists()
        attempts = {*attempts_in(folder, point.name), *([path] if point.file else [])}
        errors = _recover(sorted(attempts), point.measurement)
        match point.state:
            case JournalPointState.DONE if not path.exists():
                journal.requeue(point.name, ReasonCode.GONE, f"{point.file} is no longer in the folder")
            case JournalPointState.DONE:
                found = read_attempt(path, point.measurement, SealDepth.WHOLE)
                if found.damage:
                    journal.requeue(point.name, ReasonCode.DAMAGED, found.damage)
            case state if point.file:
                ended = _end_of_attempt(path, point.measurement, errors)
                # The journal may state a failure although the file is complete; then the file is right.
                if has_part or state is JournalPointState.RUNNING or ended[0] is JournalPointState.DONE:
                    journal.end(point.name, *ended)


def find_recordings(
    points: Sequence[Point], folder: Path, depth: SealDepth, stop: StopSwitch | None = None
) -> dict[str, KeptRecording]:
    """Return a folder's recordings, keyed by point, for a campaign whose journal is lost or never existed.

    After a stop request, the samples of further recordings are left unchecked until the next resume. Damaged
    recordings are returned too, and so are recordings whose seal is in no journal of the folder (the campaign
    may have been renamed). Raises RecordingError when a complete recording was made with another plan.
    """
    found: dict[str, KeptRecording] = {}
    for point in points:
        now = depth if stop is None or stop.request is None else SealDepth.QUICK
        if (kept := complete_attempt(folder, point.name, point.measurement, now)) is not None:
            found[point.name] = kept
    return found


def _recover(attempts: Iterable[Path], measurement: Measurement) -> dict[str, str]:
    """Recover every unfinished attempt at a point; return the errors by file name.

    Raises RecordingError when a complete recording cannot be recovered; its point is not measured again.
    """
    errors: dict[str, str] = {}
    for path in attempts:
        if not part_of(path).exists():
            with suppress(OSError):  # a .tmp without a .part contains no sample
                tmp_of(path).unlink()
            continue
        try:
            recover(path)
        except RecordingError as error:
            left = read_attempt(part_of(path), measurement, SealDepth.QUICK)
            if left.is_complete and left.is_of_this_plan and not path.exists():
                raise
            errors[path.name] = str(error)
    return errors


def _end_of_attempt(
    path: Path, measurement: Measurement, errors: Mapping[str, str]
) -> tuple[JournalPointState, ReasonCode, str, str]:
    if not path.exists():
        why = errors.get(path.name, "nothing was recorded")
        return JournalPointState.INTERRUPTED, ReasonCode.PROGRAM_ENDED, f"{PROGRAM_ENDED}; {why}", ""
    found = read_attempt(path, measurement, SealDepth.WHOLE)
    if found.damage:
        return JournalPointState.INTERRUPTED, ReasonCode.DAMAGED, found.damage, found.seal
    if found.is_complete and found.is_of_this_plan:
        return JournalPointState.DONE, ReasonCode.CARRIED_OUT, found.reason, found.seal
    match found.state:
        case RecordingState.FAILED:
            ended = JournalPointState.FAILED, ReasonCode.FAULT
        case RecordingState.STOPPED:
            ended = JournalPointState.INTERRUPTED, ReasonCode.STOPPED
        case _:
            ended = JournalPointState.INTERRUPTED, ReasonCode.PROGRAM_ENDED
    is_cut = found.state is RecordingState.INTERRUPTED
    reason = f"{PROGRAM_ENDED}, after {found.duration_s:.1f} s of samples" if is_cut else found.reason
    return *ended, reason, found.seal


MOST_DIFFERENCES = 5
"""Largest number of differences listed in an error message."""


def rig_at(rig: Rig, measurement: Measurement) -> Rig:
    """Return the rig with the beam at the point that a measurement needs.

    Raises ConfigurationError when the vibrometer of the rig cannot measure at this point.
    """
    return rig if measurement.point is None else rig.with_beam_on(measurement.point.role)


def require_all_within_limits(points: tuple[Point, ...], bench: Bench) -> list[tuple[str, LimitCheck]]:
    """Refuse a campaign with a point that exceeds a limit or cannot be played; return all checks by point.

    Equal plans are checked only once, because checking every point of a long campaign would make viewers
    wait. Raises LimitExceeded, or ConfigurationError when the vibrometer cannot measure at a point of a scan.
    """
    complaints: dict[str, str] = {}
    checks: list[tuple[str, LimitCheck]] = []
    for point in points:
        rig_at(bench.rig, point.measurement)
    for point in distinct_drives(points):
        try:
            checks += [(point.name, each) for each in require_within_limits(point.measurement, bench.rig)]
            drive_for(bench, point.measurement)  # raises an error if this bench cannot play the plan
        except LimitExceeded as error:
            complaints[point.name] = str(error)
    if complaints:
        _, *others = leading(list(complaints))
        also = f" Other measurements that exceed a limit: {', '.join(others)}." if others else ""
        raise LimitExceeded(next(iter(complaints.values())) + also)
    return checks


def planned_recordings(
    campaign: Campaign, folder: Path, existing: ExistingRecordings
) -> tuple[PlannedRecording, ...]:
    """Return all recordings of a campaign, and state which exist already; change nothing.

    Raises RecordingError when recordings exist and ``existing`` refuses that, or a complete recording was
    made with another plan.
    """
    points = campaign.points()
    if existing is ExistingRecordings.RESUME:
        path = journal_path(folder, campaign.name)
        if not journal_exists(path):
            kept = find_recordings(points, folder, SealDepth.QUICK)
            found = {name: each.path for name, each in kept.items() if each.is_complete}
            wanted = [(each.name, each.measurement) for each in points]
        else:
            known = read_journal(path)
            found = {
                each.name: folder / each.file
                for each in known
                if each.file
                for kept in [read_attempt(folder / each.file, each.measurement, SealDepth.QUICK)]
                if (kept.is_complete and kept.is_of_this_plan)
                or (each.state is JournalPointState.DONE and not kept.damage)
            }
            wanted = [(each.name, each.measurement) for each in known]
        return tuple(
            PlannedRecording(name, measurement, done or next_attempt(folder, name), done is not None)
            for name, measurement in wanted
            for done in [found.get(name)]
        )
    require_new(campaign, points, folder)
    return tuple(
        PlannedRecording(each.name, each.measurement, next_attempt(folder, each.name)) for each in points
    )


def open_journal(
    bench: Bench,
    campaign: Campaign,
    folder: Path,
    existing: ExistingRecordings,
    changed: ChangedBench,
    stop: StopSwitch,
) -> Journal:
    """Return the campaign's journal: a new one, or the existing one updated from the folder.

    Raises RecordingError when the folder contains recordings of the campaign and ``existing`` refuses that,
    or the journal belongs to another plan. Raises CheckFailed when the bench differs from the bench at the
    start of the campaign and ``changed`` refuses this.
    """
    path = journal_path(folder, campaign.name)
    identity, points = BenchIdentity.of(bench), campaign.points()
    if existing is ExistingRecordings.REFUSE:
        require_new(campaign, points, folder)
        return Journal.begin(path, campaign, identity)
    if journal_exists(path):
        return _resume_journal(path, campaign, identity, folder, changed, stop)
    for point in points:
        _recover(attempts_in(folder, point.name), point.measurement)
    found = find_recordings(points, folder, SealDepth.WHOLE, stop)
    if changed is ChangedBench.REFUSE:
        for point in points:
            kept = found.get(point.name)
            if kept is not None and not kept.damage:
                now = rig_at(bench.rig, point.measurement).model_dump(mode="json")
                _require_no_differences(differences(kept.rig, now))
    journal = Journal.begin(path, campaign, identity)
    for name, kept in found.items():
        if kept.damage:
            journal.requeue(name, ReasonCode.DAMAGED, kept.damage)
        else:
            journal.keep(name, kept.path.name, kept.seal)
    return journal


def require_same_bench(begun_on: BenchIdentity, now: BenchIdentity) -> None:
    """Refuse to continue a campaign on a bench that has changed; raises CheckFailed."""
    _require_no_differences(begun_on.differences(now))


def _require_no_differences(found: tuple[str, ...]) -> None:
    if found:
        shown = "; ".join(leading(found, MOST_DIFFERENCES))
        raise CheckFailed(
            f"the bench has changed since the campaign started: {shown}. Nothing was played; "
            "restore the bench as it was, or accept the change (--accept-changed-bench)"
        )


def make_folder(folder: Path) -> None:
    """Create the folder for the recordings; raises RecordingError if that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(
            f"the folder {folder} cannot be created ({error.strerror}). Nothing was played; "
            "give a folder that exists, or another path for the new folder"
        ) from error


def _resume_journal(
    path: Path,
    campaign: Campaign,
    now: BenchIdentity,
    folder: Path,
    changed: ChangedBench,
    stop: StopSwitch,
) -> Journal:
    with ExitStack() as undo:
        journal = undo.enter_context(Journal.open(path))
        if _points_to_make(journal.campaign) != _points_to_make(campaign):
            raise RecordingError(
                f"the plan of {campaign.name!r} has changed since {journal.path} was written. Nothing was "
                "recorded; give the changed campaign another name, or choose another folder"
            )
        begun_on = journal.bench
        match changed:
            case ChangedBench.REFUSE:
                require_same_bench(begun_on, now)
            case ChangedBench.ACCEPT if begun_on.differences(now):
                journal.accept_bench(now)
        reconcile(journal, folder, stop)
        undo.pop_all()
    return journal


def _points_to_make(campaign: Campaign) -> tuple[tuple[str, Measurement], ...]:
    """Return the points of a plan without their notes, because the notes may change."""
    return tuple((name, each.model_copy(update={"notes": ""})) for name, each in campaign.recordings())


def require_new(campaign: Campaign, points: tuple[Point, ...], folder: Path) -> None:
    """Refuse a folder that has recordings of the campaign; raises RecordingError and changes nothing."""
    present = [str(path) for point in points for path in attempts_in(folder, point.name)]
    path = journal_path(folder, campaign.name)
    if not present and journal_exists(path):
        present = [str(path)]
    if present:
        shown = ", ".join(present[:MOST_DIFFERENCES]) + (
            " and more" if len(present) > MOST_DIFFERENCES else ""
        )
        verb = "exists" if len(present) == 1 else "exist"
        raise RecordingError(
            f"{shown} {verb} already, and nothing is ever overwritten. "
            "Nothing was recorded; give another folder, or resume the campaign"
        )
