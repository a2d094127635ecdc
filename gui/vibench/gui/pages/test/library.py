"""Tests by name: those of the campaigns that come with vibench, and one's own, as TOML files."""

from dataclasses import dataclass
from pathlib import Path

from vibench.acquisition import ConfigurationError, all_shipped, load_campaign, load_toml
from vibench.acquisition.plan import Measurement

FIRST = "quick"
"""The campaign whose tests are listed before all others."""
MOST_OF_ONE = 12
"""Tests listed of one campaign; sweeps make hundreds."""


@dataclass(frozen=True)
class NamedTest:
    """A test and where it is from."""

    label: str
    measurement: Measurement


def shipped_tests() -> tuple[NamedTest, ...]:
    """Every measurement of the campaigns that come with vibench."""
    campaigns = [load_campaign(path) for path in all_shipped("campaigns")]
    return tuple(
        NamedTest(f"{campaign.name} / {each.name}", each)
        for campaign in sorted(campaigns, key=lambda each: (each.name != FIRST, each.name))
        for each in sorted(campaign.measurements[:MOST_OF_ONE], key=lambda each: each.name)
    )


def own_tests(folder: Path) -> tuple[NamedTest, ...]:
    """Every test that was saved in a folder; a file that cannot be read is left out."""
    found: list[NamedTest] = []
    for path in sorted(folder.glob("*.toml")):
        try:
            found.append(NamedTest(f"own / {path.stem}", load_test(path)))
        except ConfigurationError:
            continue
    return tuple(found)


def load_test(path: Path) -> Measurement:
    """Read a test; raises ConfigurationError with file, key and what is allowed."""
    return load_toml(path, Measurement)
