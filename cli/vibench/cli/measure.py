"""`vibench measure`: run a campaign, with one recording per measurement."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import vibench.analysis
from vibench.acquisition import AcquisitionError, CheckRule, load_campaign, load_toml, stop_on_signal
from vibench.acquisition.campaign import (
    AfterFailure,
    CampaignEstimate,
    ChangedBench,
    CommandMessenger,
    ExistingRecordings,
    MailMessenger,
    MailSettings,
    Messenger,
    PointOutcome,
    estimate_campaign,
)
from vibench.acquisition.engine import (
    CampaignRequest,
    Engine,
    JobQueue,
    RequestHandler,
    Supervision,
    TwinSwitch,
    serving,
)
from vibench.acquisition.plan import Campaign, Family, distinct_drives, require_within_limits
from vibench.acquisition.rig import Confirm, Rig, confirm_by_sheet
from vibench.sim import count_text, number_of

from .engine_bars import show_status
from .options import option
from .output import ExitCode, console, errors, paragraph, print_json
from .paths import AsJson, BenchPath, FaultsPath, rig_at

if TYPE_CHECKING:
    from vibench.analysis import ExpectedResult, TimeShare

Known = Mapping[str, Sequence["ExpectedResult"]]
EndsS = Mapping[str, tuple[float | None, float]]


def estimate_document(
    expected: CampaignEstimate, shares: Sequence["TimeShare"], known: Known, ends_s: EndsS
) -> dict[str, object]:
    """Return a campaign's estimate, with expected uncertainties and recording times, as a JSON document."""
    return asdict(expected) | {
        "needed_bytes": expected.needed_bytes,
        "fits": expected.fits,
        "uncertainty": {name: [each.to_dict() for each in found] for name, found in known.items()},
        "until": {name: {"expected_s": end, "longest_s": most} for name, (end, most) in ends_s.items()},
        "within": [asdict(each) for each in shares],
    }


def print_estimate(
    expected: CampaignEstimate, shares: Sequence["TimeShare"], known: Known, ends_s: EndsS
) -> None:
    """Print a campaign's number of recordings, time, size, free space, and expected uncertainty."""
    for share in shares:
        console.print(share.sentence)
    console.print(paragraph(estimate_text(expected)))
    for name, (end_s, longest_s) in ends_s.items():
        length = "an unknown time" if end_s is None else f"about {end_s:.3g} s"
        console.print(f"{name}: records {length} until its targets are met, at most {longest_s:.4g} s")
    for name, found in known.items():
        for each in found:
            console.print(f"{name}: {each.sentence}")


def expected_results(campaign: Campaign, rig: Rig) -> dict[str, tuple["ExpectedResult", ...]]:
    """Return the expected results of measurements and of noise tests in sweeps; may raise LimitExceeded."""
    for point in distinct_drives(campaign.points()):
        require_within_limits(point.measurement, rig)
    swept = distinct_drives(tuple(point for sweep in campaign.sweeps for point in sweep.points()))
    noise = {
        each.name: each.measurement for each in swept if each.measurement.excitation.family is Family.NOISE
    }
    plans = {each.name: each for each in campaign.measurements} | noise
    found = {name: vibench.analysis.expected_uncertainty(each, rig) for name, each in plans.items()}
    return {name: each for name, each in found.items() if each}


def estimate_text(expected: CampaignEstimate) -> str:
    """Return the estimate of a campaign as text of several lines."""
    most = "at most " if expected.searching else ""
    length = f"{most}{timedelta(seconds=round(expected.duration_s))}"
    kept = f" ({expected.kept} kept)" if expected.kept else ""
    room = f"about {expected.total_bytes / 1e6:.0f} MB; {expected.free_bytes / 1e6:.0f} MB are free"
    lines = [f"{count_text(expected.recordings, 'recording')}{kept}, {length} (h:min:s) of rig time, {room}"]
    if expected.rest_s:
        lines.append(f"Silence between recordings: {timedelta(seconds=round(expected.rest_s))} (included)")
    if expected.lead_in_s:
        lead_in = timedelta(seconds=round(expected.lead_in_s))
        lines.append(f"Lead-ins to points of chains: {lead_in} (included)")
    if not expected.fits:
        lines.append("The disk may be full before the end: make room, or record elsewhere")
    return "\n".join(lines)


def expected_ends_s(campaign: Campaign, rig: Rig) -> dict[str, tuple[float | None, float]]:
    """Return the expected and the longest recording time [s] of each measurement that sets `until`."""
    waiting = [each for each in campaign.measurements if each.until is not None]
    found = vibench.analysis.expected_recorded_s
    return {each.name: (found(each, rig), vibench.analysis.recorded_s(each)) for each in waiting}


def duration_s(text: str) -> float:
    """Return the number of seconds in a duration such as ``30min``, ``1.5 h`` or ``90 s``."""
    try:
        seconds = number_of(text, "s", "min", "h")
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds < math.inf:
        raise vibench.analysis.InvalidRequest(
            f"--within was given as {text!r}; give a time above zero with s, min or h, such as 30min"
        )
    return seconds


def measure(
    campaign: Annotated[
        Path,
        typer.Argument(metavar="CAMPAIGN", help="TOML file of the campaign, or a shipped name: quick."),
    ],
    out: Annotated[Path, option("Folder for the recordings.", "DIR")],
    bench: BenchPath = None,
    resume: Annotated[bool, option("Keep complete recordings in DIR and record the missing ones.")] = False,
    after_failure: Annotated[AfterFailure, option("What to do after a failed point.")] = AfterFailure.STOP,
    accept_changed_bench: Annotated[bool, option("Resume on a different bench.")] = False,
    faults: FaultsPath = None,
    knobs: Annotated[
        Path | None, option("File of settings confirmed with `vibench bench check --knobs`.", "SHEET.toml")
    ] = None,
    check: Annotated[
        CheckRule, option("Require a recent passed check, make a check now, or require no check.")
    ] = CheckRule.FRESH,
    only_estimate: Annotated[
        bool,
        option(
            "Print time, size and expected uncertainty of the results; measure nothing.",
            name="--estimate",
        ),
    ] = False,
    time_limit: Annotated[
        str | None,
        option("Divide this time among the measurements that have `until`.", "TIME", name="--within"),
    ] = None,
    as_json: AsJson = False,
    twin: Annotated[
        bool, option("Also estimate the hidden motion, and report changes of the specimen.")
    ] = False,
    notify: Annotated[
        str | None,
        option(
            "Command to run (no shell) at every fault and at the end; it gets the reason as JSON on stdin.",
            "COMMAND",
        ),
    ] = None,
    mail: Annotated[Path | None, option("Send mail at every fault and at the end.", "MAIL.toml")] = None,
    move_beam: Annotated[
        str | None,
        option(
            "Command (no shell) that moves the vibrometer to each point of a scan; it gets the point as "
            "JSON on stdin.",
            "COMMAND",
        ),
    ] = None,
) -> None:
    """Measure: check the bench, ramp up, record and ramp down, for each measurement of a campaign."""
    plan, rig = load_campaign(campaign), rig_at(bench, faults)
    existing = ExistingRecordings.RESUME if resume else ExistingRecordings.REFUSE
    shares: tuple[TimeShare, ...] = ()
    if time_limit is not None:
        plan, shares = vibench.analysis.fit_to(plan, rig, duration_s(time_limit))
    known = expected_results(plan, rig) if only_estimate else {}
    estimate = (
        estimate_campaign(plan, rig, out, existing),
        shares,
        known,
        expected_ends_s(plan, rig) if only_estimate else {},
    )
    if only_estimate and as_json:
        print_json(estimate_document(*estimate))
    else:
        print_estimate(*estimate)
    if only_estimate:
        return
    found: list[Messenger] = []
    if notify is not None:
        found.append(CommandMessenger.of(notify))
    if mail is not None:
        found.append(MailMessenger(load_toml(mail.expanduser(), MailSettings)))
    messengers = tuple(found)
    mover = None if move_beam is None else CommandMessenger.of(move_beam)
    request = CampaignRequest(
        campaign=plan,
        folder=out,
        twin=TwinSwitch.ON if twin else TwinSwitch.OFF,
        existing=existing,
        after_failure=after_failure,
        changed_bench=ChangedBench.ACCEPT if accept_changed_bench else ChangedBench.REFUSE,
        check=check,
    )
    with the_bench(rig, plan.name, None if knobs is None else confirm_by_sheet(knobs)) as engine:
        point_results = engine.measure(request, messengers=messengers, move_beam=mover)
    if as_json:
        rows = [
            {"name": each.name, "outcome": each.outcome.value, "path": str(each.path), "reason": each.reason}
            for each in point_results
        ]
        print_json({"recordings": rows})
    failed = [each for each in point_results if each.outcome is PointOutcome.FAILED]
    for each in failed:
        errors.print(f"error: {each.name}: {each.reason}")
    if failed:
        raise typer.Exit(ExitCode.FAILED)
    if engine.switch.request is not None:
        raise typer.Exit(ExitCode.STOPPED)


@contextmanager
def the_bench(rig: Rig, what: str, confirm: Confirm | None = None) -> Iterator[Engine]:
    """Open a bench in this process, with progress bars; `vibench watch` and `vibench stop` can reach it."""
    engine = Engine(Supervision.UNATTENDED)
    handler = RequestHandler(engine, JobQueue(engine))
    try:
        engine.open(rig, confirm)
        with serving(handler, what), stop_on_signal(engine.switch, what), show_status(handler.status, engine):
            yield engine
    except BaseException as error:
        try:
            engine.close()
        except AcquisitionError as failure:
            error.add_note(f"While leaving the bench: {failure}")
        raise
    engine.close()
