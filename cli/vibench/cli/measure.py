"""`vibench measure`: carry out a campaign, one recording a measurement."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import CheckRule, ConfigurationError, load_campaign
from vibench.acquisition.campaign import AfterFailure, ChangedBench, Existing, Item, estimate
from vibench.acquisition.engine import Attendance, Desk, Engine, Orders, Work, hosted
from vibench.acquisition.rig import Rig

from .engine_bars import Watching
from .estimate_text import Form, tell_estimate
from .messengers import MailPath, NotifyCommand, messengers_of
from .paths import BenchPath, FaultsPath, rig_at

STOPPED_EXIT_CODE = 3
"""Not everything was recorded, and nothing failed: somebody stopped it."""


def measure(
    campaign: Annotated[Path, typer.Argument(metavar="CAMPAIGN.toml", help="What to measure.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the recordings.")],
    bench: BenchPath = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Keep complete recordings in DIR and make the missing ones.")
    ] = False,
    after_failure: Annotated[
        AfterFailure, typer.Option("--after-failure", help="When a point has failed for good.")
    ] = AfterFailure.STOP,
    accept_changed_bench: Annotated[
        bool, typer.Option("--accept-changed-bench", help="Resume on another bench than it was begun on.")
    ] = False,
    faults: FaultsPath = None,
    check: Annotated[
        CheckRule, typer.Option(help="A passed check of the bench, of today: ask for it, make it, or not.")
    ] = CheckRule.FRESH,
    only_estimate: Annotated[
        bool, typer.Option("--estimate", help="Say how long it takes and how large it becomes; play nothing.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="With --estimate: print one JSON document and nothing else.")
    ] = False,
    notify: NotifyCommand = None,
    mail: MailPath = None,
) -> None:
    """Measure: check the bench, ramp up, record and ramp down, for each measurement of a campaign."""
    if as_json and not only_estimate:
        raise ConfigurationError(
            "--json prints an estimate, and none was asked for. Nothing was played; add --estimate, or leave "
            "--json out"
        )
    plan, rig = load_campaign(campaign), rig_at(bench, faults)
    existing = Existing.RESUME if resume else Existing.REFUSE
    tell_estimate(estimate(plan, rig, out, existing), Form.JSON if as_json else Form.TEXT)
    if only_estimate:
        return
    messengers = messengers_of(notify, mail)
    orders = Orders(
        campaign=plan,
        folder=out,
        existing=existing,
        after_failure=after_failure,
        changed_bench=ChangedBench.ACCEPT if accept_changed_bench else ChangedBench.REFUSE,
        check=check,
    )
    with the_bench(rig, plan.name) as engine:
        items = engine.measure(orders, messengers=messengers)
    if engine.switch.request is not None:
        raise typer.Exit(STOPPED_EXIT_CODE)
    if any(item.result is Item.FAILED for item in items):
        raise typer.Exit(1)


@contextmanager
def the_bench(rig: Rig, what: str) -> Iterator[Engine]:
    """Open a bench in this process, with bars on the terminal and a door for whoever watches or stops it."""
    engine = Engine(Attendance.UNATTENDED)
    desk = Desk(engine, Work(engine))
    with closing(engine):
        engine.open(rig)
        with hosted(desk, what), Watching(desk.status):
            yield engine
