"""What a campaign will take, as a person or a program reads it."""

from dataclasses import asdict
from datetime import timedelta
from enum import StrEnum

from vibench.acquisition.campaign import Estimate

from .output import console, print_json


class Form(StrEnum):
    """Who reads it."""

    TEXT = "text"
    JSON = "json"


def tell_estimate(expected: Estimate, form: Form) -> None:
    """Say how many recordings, how long and how large, and whether the disk has room for them."""
    match form:
        case Form.JSON:
            print_json(asdict(expected) | {"needed_bytes": expected.needed_bytes, "fits": expected.fits})
        case Form.TEXT:
            console.print(estimate_text(expected), markup=False)


def estimate_text(expected: Estimate) -> str:
    """Put an estimate into a few lines."""
    length = timedelta(seconds=round(expected.duration_s))
    kept = f" ({expected.kept} kept)" if expected.kept else ""
    room = f"about {expected.total_bytes / 1e6:.0f} MB; {expected.free_bytes / 1e6:.0f} MB are free"
    count = "1 recording" if expected.recordings == 1 else f"{expected.recordings} recordings"
    lines = [f"{count}{kept}, {length} (h:min:s) of rig time, {room}"]
    if expected.rest_s:
        lines.append(f"{timedelta(seconds=round(expected.rest_s))} of it are silence between recordings")
    if expected.lead_in_s:
        lead_in = timedelta(seconds=round(expected.lead_in_s))
        lines.append(f"{lead_in} of it lead to points along their chains")
    if not expected.fits:
        lines.append("The disk may be full before the end: make room, or record elsewhere")
    return "\n".join(lines)
