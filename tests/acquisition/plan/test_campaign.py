"""Campaign files: defaults, refusals, exact round trips, and the shipped files."""

import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given, strategies as st
from pydantic import ValidationError

from vibench.acquisition import ConfigurationError, load_campaign, toml_text
from vibench.acquisition.excitation.kinds import EXCITATION_KINDS
from vibench.acquisition.excitation.stepped_sine import FrequencyGrid
from vibench.acquisition.plan import (
    Campaign,
    Dwell,
    InRunLimits,
    Measurement,
    OddMultisine,
    OnOverload,
    SineSweep,
    SteppedSine,
    StreamedNoise,
    WhiteNoise,
    require_within_limits,
)
from vibench.acquisition.rig import load_rig

ROOT = Path(__file__).parent.parent.parent.parent
SHIPPED = sorted((ROOT / "campaigns").glob("*.toml"))

DWELL_TABLE = """
[[measurements]]
name = "dwell"
[measurements.excitation]
kind = "dwell"
amplitude_vpp = 1.5
frequency_hz = 260
duration_s = 2
"""


def load(tmp_path, text):
    path = tmp_path / "campaign.toml"
    path.write_text(text, encoding="utf-8")
    return load_campaign(path)


EXCITATIONS = st.one_of(
    st.builds(
        Dwell,
        amplitude_vpp=st.floats(0.002, 20),
        frequency_hz=st.floats(1e-3, 1e5),
        duration_s=st.floats(1e-3, 1e4),
    ),
    st.builds(
        SteppedSine,
        amplitude_vpp=st.floats(0.002, 20),
        frequencies_hz=st.lists(st.floats(1, 1e4), min_size=1, max_size=9, unique=True).map(
            lambda values: tuple(sorted(values))
        ),
    ),
    st.just(SteppedSine(amplitude_vpp=1, grid=FrequencyGrid(start_hz=1, stop_hz=9, step_hz=0.1))),
    st.just(OddMultisine(amplitude_vpp=1, band_start_hz=20, band_stop_hz=90)),
    st.just(WhiteNoise(amplitude_vpp=0.05, band_start_hz=20, band_stop_hz=800)),
    st.just(SineSweep(amplitude_vpp=1.5, start_hz=350, stop_hz=150, duration_s=20)),
    st.just(StreamedNoise(amplitude_vpp=1.5, band_start_hz=20, band_stop_hz=800, duration_s=9)),
)
# Lone surrogates are not text and cannot be stored in a file.
TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=40)
MEASUREMENTS = st.builds(
    Measurement,
    name=st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_-]{0,10}", fullmatch=True),
    excitation=EXCITATIONS,
    ramp_s=st.floats(0.3, 60),
    notes=TEXT,
    limits=st.builds(InRunLimits, on_overload=st.sampled_from(OnOverload), current=st.floats(0.01, 1)),
)


class TestRoundTrips:
    @pytest.mark.thorough
    @given(
        measurements=st.lists(
            MEASUREMENTS, min_size=1, max_size=4, unique_by=lambda measurement: measurement.name.lower()
        ),
        notes=TEXT,
    )
    def test_a_campaign_round_trips_through_toml(self, tmp_path_factory, measurements, notes):
        campaign = Campaign(name="c", notes=notes, measurements=tuple(measurements))
        path = tmp_path_factory.mktemp("toml") / "c.toml"
        path.write_bytes(toml_text(campaign).encode())
        assert load_campaign(path) == campaign

    @given(measurement=MEASUREMENTS)
    def test_a_measurement_is_unchanged_after_writing_and_reading_json(self, measurement):
        assert Measurement.model_validate_json(measurement.model_dump_json()) == measurement

    @pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
    def test_a_shipped_campaign_is_unchanged_after_writing_and_loading(self, tmp_path, path):
        campaign = load_campaign(path)
        assert load(tmp_path, toml_text(campaign)) == campaign


class TestDefaults:
    @pytest.mark.parametrize(
        ("defaults", "ramp_s", "found"),
        [
            ("ramp_s = 0.7\n[defaults.dwell]\nsettle_s = 9.0", 0.7, {"settle_s": 9.0, "duration_s": 2.0}),
            ("[defaults.dwell]\nduration_s = 9.0", 1.0, {"duration_s": 2.0}),
            ("[defaults.sine_sweep]\nstep_s = 9.0", 1.0, {"duration_s": 2.0}),
        ],
        ids=["missing values are filled in", "a given value remains", "other kinds have no effect"],
    )
    def test_defaults_of_an_excitation_apply_to_its_missing_values(self, tmp_path, defaults, ramp_s, found):
        text = f'name = "c"\n[defaults]\n{defaults}\n' + DWELL_TABLE
        (measurement,) = load(tmp_path, text).measurements
        assert measurement.ramp_s == ramp_s
        assert found.items() <= measurement.excitation.model_dump().items()

    @pytest.mark.parametrize(
        ("defaults", "unknown"), [("ramp_ms = 9.0", "ramp_ms"), ("[defaults.dwel]\nsettle_s = 9.0", "dwel")]
    )
    def test_a_misspelt_default_or_kind_of_excitation_is_refused(self, tmp_path, defaults, unknown):
        text = f'name = "c"\n[defaults]\n{defaults}\n' + DWELL_TABLE
        with pytest.raises(ConfigurationError, match=rf"measurements\.0\.{unknown} is not a known key"):
            load(tmp_path, text)


class TestRefusals:
    def test_a_bench_file_given_as_a_campaign_is_refused_with_a_readable_message(self):
        bench = Path(__file__).parents[3] / "hardware_configs" / "virtual_rig.toml"
        with pytest.raises(
            ConfigurationError, match="specimen, virtual are not known keys: check"
        ) as refused:
            load_campaign(bench)
        assert str(refused.value).count("not known key") == 1

    def test_errors_name_the_file_the_key_and_the_allowed_values(self, tmp_path):
        text = 'name = "c"\n' + DWELL_TABLE.replace("1.5", "5000")
        with pytest.raises(ConfigurationError) as refused:
            load(tmp_path, text)
        said = str(refused.value)
        assert said.startswith(str(tmp_path / "campaign.toml"))
        assert "measurements.0.excitation.dwell.amplitude_vpp = 5000" in said
        assert "less than or equal to 1000" in said

    @pytest.mark.parametrize(("place", "name"), [('name = "c"', "con"), ('name = "dwell"', "Com1")])
    def test_names_that_windows_reserves_are_refused_except_in_stored_plans(self, tmp_path, place, name):
        text = ('name = "c"\n' + DWELL_TABLE).replace(place, f'name = "{name}"')
        with pytest.raises(ConfigurationError, match=f"(?i)the name '{name}' is reserved by Windows"):
            load(tmp_path, text)
        stored = load(tmp_path, 'name = "c"\n' + DWELL_TABLE).model_copy(update={"name": name})
        assert Campaign.model_validate_json(stored.model_dump_json()) == stored

    def test_two_measurements_with_the_same_name_are_refused(self, tmp_path):
        with pytest.raises(ConfigurationError, match="two measurements would be recorded as 'dwell'"):
            load(tmp_path, 'name = "c"\n' + DWELL_TABLE + DWELL_TABLE.replace('"dwell"\n[', '"Dwell"\n['))

    def test_a_repeat_that_gets_the_name_of_another_measurement_is_refused(self, tmp_path):
        twice = DWELL_TABLE.replace("[measurements.exc", "repeats = 2\n[measurements.exc")
        with pytest.raises(ConfigurationError, match="recorded as 'dwell-2'"):
            load(tmp_path, 'name = "c"\n' + twice + DWELL_TABLE.replace('name = "dwell"', 'name = "dwell-2"'))

    @pytest.mark.parametrize("name", ["", "a b", "../up", ".hidden", "a.b", "ü", "x" * 65])
    def test_a_name_must_be_a_portable_file_name(self, name):
        with pytest.raises(ValueError, match="name"):
            Measurement(name=name, excitation=Dwell(amplitude_vpp=1, frequency_hz=1, duration_s=1))

    def test_an_empty_campaign_is_refused(self, tmp_path):
        with pytest.raises(ConfigurationError, match="measurements"):
            load(tmp_path, 'name = "c"\nmeasurements = []\n')

    def test_an_empty_list_of_failures_that_allow_a_retry_is_refused(self, tmp_path):
        with pytest.raises(ConfigurationError, match=r"retry\.on = \[\]: give 1 or more"):
            load(tmp_path, 'name = "c"\n' + DWELL_TABLE + "\n[retry]\nattempts = 3\non = []\n")

    def test_a_ramp_with_fewer_than_four_steps_is_refused(self):
        with pytest.raises(ValueError, match=r"ramp_step_s = 0\.1 gives fewer than 4 steps.*at most 0\.05"):
            Measurement(
                name="a",
                excitation=Dwell(amplitude_vpp=1, frequency_hz=1, duration_s=1),
                ramp_s=0.2,
                ramp_step_s=0.1,
            )


class TestEstimates:
    def test_repeats_get_numbered_names_and_add_to_the_duration(self):
        plan = Measurement(
            name="a", excitation=Dwell(amplitude_vpp=1, frequency_hz=1, duration_s=7, settle_s=3), repeats=3
        )
        campaign = Campaign(name="c", measurements=(plan,))
        assert campaign.recording_names() == ("a-1", "a-2", "a-3")
        # Each: 0.6 s of check, 1 s of ramp up, 3 s of settling, 7 s of dwell, 1 s of ramp down.
        assert campaign.duration_s == pytest.approx(3 * 12.6)
        assert campaign.size_bytes(1000.0, 2) == 3 * 12600 * 2 * 4

    def test_the_duration_includes_a_ramp_down_and_up_at_each_change_of_waveform(self):
        noise = WhiteNoise(
            amplitude_vpp=1, band_start_hz=20, band_stop_hz=90, realisations=4, periods=2, settle_s=1
        )
        campaign = Campaign(name="c", measurements=(Measurement(name="a", excitation=noise, ramp_s=0.5),))
        assert campaign.duration_s == pytest.approx(0.6 + 4 * (0.5 + 1 + 2 + 0.5))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_campaign_stays_within_the_limits_of_the_virtual_rig(path):
    rig = load_rig("virtual_rig")
    for _, measurement in load_campaign(path).recordings():
        require_within_limits(measurement, rig)


def test_version_0_1_campaigns_may_use_the_old_name_of_white_noise():
    text = (ROOT / "campaigns" / "paper.toml").read_text("utf-8")
    former = tomllib.loads(text.replace("white_noise", "multisine_noise"))
    present = tomllib.loads(text)
    assert Campaign.model_validate(former) == Campaign.model_validate(present)
    both = {**present, "defaults": {**present["defaults"], **former["defaults"]}}
    with pytest.raises(ValidationError, match="into one table"):
        Campaign.model_validate(both)


def test_the_paper_campaign_has_the_levels_and_times_of_the_paper():
    plans = {
        each.name: each.excitation for each in load_campaign(ROOT / "campaigns" / "paper.toml").measurements
    }
    noise = [plan.amplitude_vpp for plan in plans.values() if plan.kind == "white_noise"]
    dwells = [plan for plan in plans.values() if plan.kind == "dwell"]
    sweep = plans["sweep_moderate"]
    assert noise == [0.05, 1.5, 10]
    assert [plan.amplitude_vpp for plan in dwells] == [0.05, 1.5, 10]
    assert {plan.frequency_hz for plan in dwells} == {260}
    assert min(plan.duration_s for plan in dwells) >= 10
    assert (sweep.start_hz, sweep.stop_hz, sweep.duration_s, sweep.amplitude_vpp) == (150, 350, 200, 1.5)


def test_the_campaigns_page_shows_a_valid_value_for_each_required_key_of_every_kind(tmp_path):
    page = (ROOT / "docs" / "campaigns.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| [^|]+ \| (.*=.*) \|$", page, re.MULTILINE)
    assert {kind for kind, _ in rows} == set(EXCITATION_KINDS)
    for kind, needs in rows:
        for keys in re.findall(r"`([^`]+)`", needs):
            excitation = f'{{ kind = "{kind}", amplitude_vpp = 0.2, {keys} }}'
            text = f'name = "c"\n[[measurements]]\nname = "m"\nexcitation = {excitation}\n'
            assert load(tmp_path, text).measurements[0].excitation.kind == kind
