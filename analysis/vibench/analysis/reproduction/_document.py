"""The page on what of the paper holds, as Markdown, made from judgements."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from vibench.sim import wilson_share

from ._claim import Claim, Expectation, Finding, Judgement, Verdict
from ._page_tables import PageTable, score_table
from ._score import DampingScore

HEAD = "| claim | where | measured | wanted | verdict |"
_RULE = "|---|---|---|---|---|"
_PIPE = "&#124;"
"""A bar inside of a cell."""
COMMAND = "vibench reproduce --out DIR --markdown docs/reproduction.md"


@dataclass(frozen=True)
class Reproduction:
    """Everything that the page is made of."""

    sections: Mapping[str, tuple[Judgement, ...]]
    """By heading, in order."""
    scores: tuple[DampingScore, ...]
    tables: tuple[PageTable, ...]
    """After the claims."""
    options: str
    """The defaults, as a sentence."""
    made_with: str
    """Versions that computed it, and how long that took."""

    @property
    def judgements(self) -> tuple[Judgement, ...]:
        """Of all sections."""
        return tuple(each for section in self.sections.values() for each in section)

    def count(self, verdict: Verdict) -> int:
        """How many claims have this verdict."""
        return sum(each.verdict is verdict for each in self.judgements)


@dataclass(frozen=True)
class Picture:
    """A figure that the page shows."""

    title: str
    path: str
    """Relative to the page."""


def reproduction_document(found: Reproduction, pictures: Sequence[Picture] = ()) -> str:
    """Write the page."""
    return "\n".join(_lines(found, pictures)) + "\n"


def _lines(found: Reproduction, pictures: Sequence[Picture]) -> Iterator[str]:
    yield from _summary(found)
    for heading, judgements in found.sections.items():
        yield from ("", f"## {heading}", "", HEAD, _RULE)
        for each in judgements:
            yield _row(each)
        yield from _differing(judgements)
        yield from ("", "How each was measured:", "")
        yield from (f"- **{each.claim.key}**: {each.claim.measured_by}" for each in judgements)
    for table in (score_table(found.scores), *found.tables):
        yield from _table(table)
    for picture in pictures:
        yield from ("", f"![{picture.title}]({picture.path})")


def _summary(found: Reproduction) -> Iterator[str]:
    yield from (
        "# What of the paper holds",
        "",
        f"Made by `{COMMAND}`; not edited by hand.",
        "Every claim of Gong et al. (2025) that has a number or a direction, measured on our simulation of",
        "their specimen, with what we want to see and the verdict. Chaotic motion is a draw: another run of",
        "it differs by some per cent, and the bounds are wide enough for that. Where it is chance which",
        "motion chaos ends in, or when, a claim is measured from several starts, a millionth of the gap",
        "apart, and the spread of each number stands behind it. The paper gives hardly any",
        "tolerances: the bounds are ours, and some were settled after a first look at the numbers. Where a",
        "claim does not hold, options are tried one by one, in the order listed, until one upholds it.",
        "The experiment of Figs. 12 to 14 is repeated on the virtual rig by `vibench demo`.",
        "",
        found.options,
        found.made_with,
        "",
        f"Of {len(found.judgements)} claims {found.count(Verdict.HOLDS)} hold under the defaults,",
        f"{found.count(Verdict.HOLDS_FOR_SHARE)} for a share of starts,",
        f"{found.count(Verdict.HOLDS_UNDER)} under another named option,",
        f"{found.count(Verdict.FAILS)} under none that was tried.",
    )
    apart = [each for each in found.judgements if each.verdict is not Verdict.HOLDS]
    if apart:
        yield from ("", "Where we differ from the paper:", "")
    for each in apart:
        yield f"- **{each.claim.key}**: {each.claim.says} {_difference(each)}"


def _difference(judgement: Judgement) -> str:
    """Say what we find instead, and which option would make us meet."""
    ours = (
        f"We find {_values(judgement.claim, judgement.findings[0])}; wanted {wanted_text(judgement.claim)}."
    )
    under = judgement.met_under
    meets = (
        f" None of {len(judgement.findings) - 1} options tried would make us meet{_except(judgement)}."
        if under is None
        else f" We meet under {under.case.name}: {_values(judgement.claim, under)}."
    )
    remark = f" {judgement.claim.remark}" if judgement.claim.remark else ""
    return ours + (meets if len(judgement.findings) > 1 else "") + remark


def _except(judgement: Judgement) -> str:
    """Say under which options some starts uphold a claim that all of none does."""
    return "".join(
        f", except {each.case.name} for {each.met} of {len(each.draws)} starts"
        for each in judgement.findings
        if each.is_met_in_part
    )


def _table(table: PageTable) -> Iterator[str]:
    yield from ("", f"## {table.title}", "", table.text, "")
    yield f"| {' | '.join(table.headings)} |"
    yield f"|{'---|' * len(table.headings)}"
    for row in table.rows:
        yield f"| {' | '.join(row)} |"


def _row(judgement: Judgement) -> str:
    claim = judgement.claim
    cells = (
        f"**{claim.key}**: {claim.says}",
        claim.place,
        _values(claim, judgement.findings[0]),
        wanted_text(claim),
        verdict_text(judgement),
    )
    return f"| {' | '.join(each.replace('|', _PIPE) for each in cells)} |"


def verdict_text(judgement: Judgement) -> str:
    """Say the verdict, with the option that it rests on."""
    under, first = judgement.met_under, judgement.findings[0]
    if judgement.verdict is Verdict.HOLDS_FOR_SHARE:
        share = wilson_share(first.met, len(first.draws))
        return (
            f"{judgement.verdict.value}: {first.met} of {len(first.draws)} "
            f"({100 * share.low:.0f} to {100 * share.high:.0f} %)"
        )
    if judgement.verdict is Verdict.HOLDS_UNDER and under is not None:
        return f"holds under {under.case.name}"
    if judgement.verdict is Verdict.HOLDS:
        return judgement.verdict.value
    return f"**{judgement.verdict.value}**{_except(judgement)}"


def _values(claim: Claim, finding: Finding) -> str:
    return "; ".join(_value(wanted, finding, number) for number, wanted in enumerate(claim.wanted))


def _value(wanted: Expectation, finding: Finding, number: int) -> str:
    """Say one number, and its spread over starts where there are several."""
    said = f"{wanted.name}: {wanted.shown(finding.values[number])}"
    if len(finding.draws) < 2:
        return said
    low, high = finding.spread(number)
    return f"{said} ({wanted.shown(low, '')} to {wanted.shown(high)} over {len(finding.draws)} starts)"


def wanted_text(claim: Claim) -> str:
    """Say what a claim wants."""
    return "; ".join(each.sentence for each in claim.wanted)


def _differing(judgements: Sequence[Judgement]) -> Iterator[str]:
    """Say what was tried where the defaults do not uphold a claim."""
    for each in judgements:
        if len(each.findings) > 1:
            yield from ("", f"Tried for **{each.claim.key}**:", "")
            for finding in each.findings:
                yield f"- {finding.case.name}: {_values(each.claim, finding)} ({_mark(finding)})"


def _mark(finding: Finding) -> str:
    if finding.is_met_in_part:
        return f"holds for {finding.met} of {len(finding.draws)} starts"
    return "holds" if finding.is_met else "does not hold"
