"""The page on what of the paper holds, as Markdown, made from judgements."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from .claim import Claim, Finding, Judgement, Verdict

HEAD = "| claim | where | measured | wanted | verdict |"
_RULE = "|---|---|---|---|---|"
_PIPE = "&#124;"
"""A bar inside of a cell."""
COMMAND = "vibench reproduce --markdown docs/reproduction.md"


@dataclass(frozen=True)
class Reproduction:
    """Everything that the page is made of."""

    sections: Mapping[str, tuple[Judgement, ...]]
    """By heading, in order."""
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


def reproduction_document(found: Reproduction) -> str:
    """Write the page."""
    return "\n".join(_lines(found)) + "\n"


def _lines(found: Reproduction) -> Iterator[str]:
    total = len(found.judgements)
    yield from (
        "# What of the paper holds",
        "",
        f"Made by `{COMMAND}`; not edited by hand.",
        "Every claim of Gong et al. (2025) that has a number or a direction, measured on our simulation of",
        "their specimen, with what we want to see and the verdict.",
        "",
        found.options,
        found.made_with,
        "",
        f"Of {total} claims {found.count(Verdict.HOLDS)} hold under the defaults,",
        f"{found.count(Verdict.HOLDS_UNDER)} under another named option,",
        f"{found.count(Verdict.FAILS)} under none that was tried.",
    )
    for heading, judgements in found.sections.items():
        yield from ("", f"## {heading}", "", HEAD, _RULE)
        for each in judgements:
            yield _row(each)
        yield ""
        yield from _differing(judgements)
        yield from (f"- **{each.claim.key}**: {each.claim.measured_by}" for each in judgements)


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
    under = judgement.met_under
    if judgement.verdict is Verdict.HOLDS_UNDER and under is not None:
        return f"holds under {under.case.name}"
    return judgement.verdict.value if judgement.verdict is Verdict.HOLDS else f"**{judgement.verdict.value}**"


def _values(claim: Claim, finding: Finding) -> str:
    shown = zip(claim.wanted, finding.values, strict=True)
    return "; ".join(f"{wanted.name}: {wanted.shown(value)}" for wanted, value in shown)


def wanted_text(claim: Claim) -> str:
    """Say what a claim wants."""
    return "; ".join(each.sentence for each in claim.wanted)


def _differing(judgements: Sequence[Judgement]) -> Iterator[str]:
    """Say what was tried where the defaults do not uphold a claim."""
    for each in judgements:
        if len(each.findings) > 1:
            yield f"Tried for **{each.claim.key}**:"
            yield ""
            for finding in each.findings:
                mark = "holds" if finding.is_met else "does not hold"
                yield f"- {finding.case.name}: {_values(each.claim, finding)} ({mark})"
            yield ""
