"""A wrong hardware configuration is refused with file, key, given value and allowed values."""

from pathlib import Path

import pytest

from vibench.acquisition import ConfigurationError
from vibench.acquisition.rig import Role, channels_of, load_rig

CONFIGS = Path(__file__).resolve().parents[3] / "hardware_configs"
VIRTUAL = CONFIGS / "virtual_rig.toml"


NEEDED = {"virtual_rig_controller": "vibench_fast_loop", "virtual_rig_keysight": "vibench_more_drivers"}


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.toml")), ids=lambda path: path.name)
def test_every_shipped_configuration_is_valid(path):
    package = NEEDED.get(path.stem, "vibench.acquisition")
    pytest.importorskip(package, reason=f"{package} is not installed")
    assert load_rig(path).name


def edited_config(tmp_path: Path, old: str, new: str, shipped: Path = VIRTUAL) -> Path:
    text = shipped.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "bench.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("gain_db = 10.0", "gain_db = 1e2", r"bench\.toml: amplifier\.gain_db = 100\.0: .*or equal to 60"),
        ("gain_db = 10.0", 'gain_db = "10 dB"', r"amplifier\.gain_db = '10 dB': give a number"),
        ("gain_db = 10.0", "gain = 10.0", r"amplifier\.gain is not a known key .did you mean gain_db"),
        ("low_cut_hz = 0.3", "low_cut_hz = 3e5", "low_cut_hz = 300000 must be below high_cut_hz"),
        ("moving_mass_kg = 0.057", "moving_mass_kg = 1.7e308", "too large to compute with"),
        ("delay_s = 8e-6", "delay_s = -1.0", r"vibrometer\.delay_s = -1\.0: .*greater than or equal to 0"),
        ("delay_s = 8e-6", "delay_s = nan", r"vibrometer\.delay_s = nan: .*finite"),
        ('resource = "USB0', 'resource = "COM3', r"generator\.resource = 'COM3.*match pattern"),
        ('physical = "ai1"', 'physical = "ai0"', r"daq: physical ai0 is given twice"),
        ("calibrated = 2026-02-10", "calibrated = 2026-02-30", r"not valid TOML.*line"),
        ("[specimen]", "[specimen", r"not valid TOML"),
        ('physical = "ao0"', 'physical = "ai0"', r"daq\.output\.physical = 'ai0': .*match pattern"),
        ("limit_v = 3.5\n", "", r"daq\.output\.limit_v is missing"),
        ("limit_v = 3.5", "limit_v = 35.0", r"daq\.output\.limit_v = 35\.0: .*less than or equal to 10"),
        ("limit_v = 3.5", "limit_v = -1.0", r"daq\.output\.limit_v = -1\.0: .*greater than 0"),
        ("ahead_s = 0.5", "ahead_s = 0.05", r"daq\.output\.ahead_s = 0\.05: .*greater than or equal to 0\.3"),
        ("ahead_s = 0.5", "ahead_s = 60", r"daq\.output\.ahead_s = 60: .*less than or equal to 5"),
        ("ahead_s = 0.5", "ahead = 0.5", r"daq\.output\.ahead is not a known key"),
        ('plays = "tones_and_streams"', 'plays = "all"', r"'all': .*'streams' or 'tones_and_streams'"),
        ("sample_rate_hz = 51200\n# L", "sample_rate_hz = 0\n# L", r"output\.sample_rate_hz = 0: .*0"),
    ],
)
def test_a_wrong_configuration_is_refused_with_the_name_of_the_wrong_key(tmp_path, old, new, said):
    streaming = CONFIGS / "virtual_rig_streaming.toml"
    shipped = VIRTUAL if old in VIRTUAL.read_text(encoding="utf-8") else streaming
    with pytest.raises(ConfigurationError, match=said) as failure:
        load_rig(edited_config(tmp_path, old, new, shipped))
    assert "TOML" in said or "\n" not in str(failure.value)


def test_a_missing_file_is_refused_with_its_path(tmp_path):
    with pytest.raises(ConfigurationError, match=r"nowhere\.toml: cannot be read"):
        load_rig(tmp_path / "nowhere.toml")


@pytest.mark.parametrize(("load", "factor"), [('"high-z"', 1.0), ("50.0", 2.0)])
def test_a_load_setting_of_50_ohm_gives_twice_the_displayed_voltage_at_the_output(tmp_path, load, factor):
    rig = load_rig(edited_config(tmp_path, 'load_ohm = "high-z"', f"load_ohm = {load}"))
    loading = 15000 / 15050
    assert rig.generator.terminal_factor() == pytest.approx(factor * loading)


def test_the_vibrometer_range_and_a_voltage_divider_set_the_scales_of_their_channels():
    rig = load_rig(VIRTUAL)
    by_role = {channel.role: channel for channel in channels_of(rig)}
    velocity = by_role[Role.M0_VELOCITY]
    assert by_role[Role.DRIVE_VOLTAGE].units_per_volt == 2.0
    assert velocity.units_per_volt == pytest.approx(rig.vibrometer.range_mm_per_s_per_v * 1e-3)
    assert velocity.full_scale_v == 4.0
    assert velocity.delay_s == rig.vibrometer.delay_s
