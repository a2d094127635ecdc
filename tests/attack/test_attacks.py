"""A few hundred reproducible broken files and messages of every kind: ``pytest -m attack``.

Longer attacks with other seeds: ``python -m tests.attack --help``.
"""

import pytest

from . import (
    altered_recordings,
    engine_messages,
    imported_files,
    instrument_messages,
    instrument_replies,
    toml_files,
)
from .tally import Shard

SEED = 2025


@pytest.mark.attack
@pytest.mark.timeout(400)
@pytest.mark.parametrize(
    ("attack", "count"),
    [
        (toml_files.attack, 50),
        (imported_files.attack, 60),
        (engine_messages.attack, 150),
        (instrument_messages.attack, 400),
        (instrument_replies.attack, 12),
        (altered_recordings.attack, 12),
    ],
    ids=["toml", "imports", "engine", "instruments", "replies", "altered"],
)
def test_no_mutant_violates_the_limits_of_its_attack(attack, count):
    tally = attack(Shard(SEED, count))
    assert tally.tried == count
    assert tally.findings == [], tally.line()
    # An attack whose messages are all refused at once proves little.
    assert len(tally.codes) > 1
