"""`vibench bench`: list instruments, check a bench, set up a new one."""

from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import (
    CheckFailed,
    CheckResult,
    ConfigurationError,
    StopSwitch,
    Verdict,
    check_bench,
    file_path,
    last_check,
    list_instruments,
    list_rig_instruments,
    open_bench,
    stop_on_signal,
)
from vibench.acquisition.instruments import PlugInKind, plug_in_names
from vibench.acquisition.rig import Rig, load_rig, save_knob_sheet

from .bench_new import new_bench
from .options import SectionedCommand, SectionedGroup, option, with_options
from .output import ExitCode, bold, console, paragraph, print_json
from .paths import AsJson, BenchPath, bench_path

bench = typer.Typer(
    help="Check and list instruments.",
    cls=SectionedGroup,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)


@bench.command("list", cls=SectionedCommand)
@with_options
def list_bench(
    bench: Annotated[
        Path | None, option("Search at this rig's addresses; by default on this computer.", "BENCH")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the connected instruments and the installed plug-ins, by name."""
    found = list_instruments() if bench is None else list_rig_instruments(load_rig(bench))
    devices = [f"{device.name}: {device.product}, serial {device.serial}" for device in found.daq_devices]
    plug_ins = [f"{kind.value}: {', '.join(plug_in_names(kind))}" for kind in PlugInKind]
    titles = {"VISA": found.visa_resources, "DAQ": devices, "Plug-ins": plug_ins, "Remarks": found.remarks}
    if as_json:
        print_json({title.lower(): list(lines) for title, lines in titles.items()})
        return
    for title, lines in titles.items():
        console.print(bold(title))
        for line in lines or ("none",):
            console.print(f"  {line}")


@bench.command("check", cls=SectionedCommand)
@with_options
def check(
    bench: BenchPath = None,
    out: Annotated[Path, option("Folder of recordings, to check free disk space.", "DIR")] = Path(),
    knobs: Annotated[
        Path | None, option("New file of confirmed settings, for `measure --knobs`.", "SHEET.toml")
    ] = None,
    last: Annotated[bool, option("Show the result of the last check, without using the bench.")] = False,
    new_reference: Annotated[
        bool, option("Make this check the reference, because the bench was changed on purpose.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Check the bench with a small sine: identities, noise, gains, signs, clocks, disk, and changes.

    The result is stored, because arming a real bench needs a recent passed check. Exit code 1 after a FAIL.
    """
    if last and (knobs is not None or new_reference):
        raise ConfigurationError(
            "--last only shows an earlier check, but --knobs and --new-reference need a new check. Nothing "
            "was done; leave out --last or the other option"
        )
    path = bench_path(bench)
    result = _last(load_rig(path)) if last else _run_check(path, out, knobs, new_reference=new_reference)
    if as_json:
        print_json(result.model_dump(mode="json"))
    else:
        console.print(f"{result.rig}: {result.verdict.value}, {result.checked:%Y-%m-%d %H:%M %Z}")
        console.print(paragraph(result.report.text()))
    if result.verdict is Verdict.FAIL:
        raise typer.Exit(ExitCode.FAILED)


@bench.command("new", cls=SectionedCommand)
@with_options
def new(
    target: Annotated[Path, typer.Argument(metavar="BENCH.toml", help="File of the configuration.")],
    template: Annotated[
        str, option("Configuration with the proposed values.", "NAME|FILE", name="--from")
    ] = "lab_rig",
    answers: Annotated[Path | None, option("Answers to all questions.", "FILE.toml")] = None,
) -> None:
    """Set up a bench: ask questions, write its file, check wiring, noise, gains and signs (first at 5 mV).

    The report is stored beside the file. Exit code 1 if a finding forbids switching the amplifier on.
    """
    page = new_bench(target, file_path(template, "hardware_configs"), answers)
    if page.verdict is Verdict.FAIL:
        raise typer.Exit(ExitCode.FAILED)


def _run_check(path: Path, out: Path, knobs: Path | None, *, new_reference: bool) -> CheckResult:
    rig, switch = load_rig(path), StopSwitch()
    with open_bench(rig) as opened, stop_on_signal(switch, "bench check"):
        if knobs is not None:
            save_knob_sheet(opened.confirmations, knobs)
        return check_bench(opened, out, switch=switch, new_reference=new_reference)


def _last(rig: Rig) -> CheckResult:
    result = last_check(rig.name)
    if result is None:
        raise CheckFailed(
            f"the bench {rig.name!r} was never checked on this account, so nothing can be shown; leave out "
            "--last to check it"
        )
    return result
