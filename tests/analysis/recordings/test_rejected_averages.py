"""Averages that the operator rejects are excluded from the results."""

from dataclasses import replace

import pytest

from vibench.acquisition import open_recording
from vibench.acquisition.recording import REJECTED, EventKind
from vibench.acquisition.recording._tables import Event
from vibench.analysis.recordings.channels import RecordedChannels


@pytest.mark.parametrize(
    ("seconds_after", "left"),
    [(-0.1, {0, 1}), (0.1, {1}), (1.0, {1})],
    ids=["before it begins", "while it is recorded", "while the next one settles"],
)
def test_averages_rejected_by_the_operator_are_excluded_from_results(noise_file, seconds_after, left):
    with open_recording(noise_file()) as recording:
        first = next(each for each in recording.segments if each.label == "realisation")
        sample = first.start + round(seconds_after * recording.sample_rate_hz)
        mark = Event(sample, 0.0, EventKind.MARK, REJECTED)
        marked = replace(recording, events=(*recording.events, mark))
        found = RecordedChannels(marked).stretches("realisation")
        assert {each.numbers["realisation"] for each in found} == left
        ways = {each.label for each in recording.segments} - {"realisation"}
        assert all(RecordedChannels(marked).stretches(each) for each in ways)
