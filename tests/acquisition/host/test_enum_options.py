"""Options accept enum members and their text values; a wrong text is refused with the allowed values."""

import pytest

from vibench.acquisition import ConfigurationError, open_bench, run_campaign
from vibench.acquisition.campaign import ExistingRecordings, list_recordings
from vibench.acquisition.host.toml_file import member


def test_an_enum_member_and_its_value_as_text_are_equivalent():
    assert member(ExistingRecordings, "resume") is ExistingRecordings.RESUME
    assert member(ExistingRecordings, ExistingRecordings.RESUME) is ExistingRecordings.RESUME


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        (
            lambda folder: run_campaign(None, None, folder, existing="keep"),
            "'keep' is not a value of ExistingRecordings; ",
        ),
        (
            lambda folder: run_campaign(None, None, folder, after_failure="sulk"),
            "'sulk' is not a value of AfterFailure; ",
        ),
        (
            lambda folder: list_recordings(folder, "some"),
            "'some' is not a value of Refresh; give one of 'changed', 'all'",
        ),
    ],
)
def test_a_wrong_option_value_is_refused_with_the_allowed_values(tmp_path, asked, sentence):
    with pytest.raises(ConfigurationError, match=sentence):
        asked(tmp_path)


def test_open_bench_accepts_the_calibration_rule_as_text(rig):
    with open_bench(rig, calibration="waived") as bench:
        assert bench.rig == rig
