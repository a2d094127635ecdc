"""Nested sweeps: points, names, order, chains and refusals."""

import pytest

from vibench.acquisition import ConfigurationError, load_campaign, toml_text, validate
from vibench.acquisition.plan import Campaign, RunState, phases, predicted_loads, require_within_limits
from vibench.acquisition.rig import BaseQuantity

DWELL = {"kind": "dwell", "settle_s": 1.0, "duration_s": 2.0}
SWEEP = {"kind": "sine_sweep", "start_hz": 300, "stop_hz": 200, "duration_s": 5}


def campaign(**sweep):
    sweep.setdefault("measurement", {"ramp_s": 0.3, "excitation": DWELL})
    return validate({"name": "c", "sweeps": [{"name": "line", **sweep}]}, Campaign, "c.toml")


def names(plan):
    return list(plan.recording_names())


class TestOrder:
    def test_the_innermost_axis_changes_fastest(self):
        plan = campaign(amplitude_vpp=[0.5, 1.5], frequency_hz={"start": 200, "stop": 210, "step": 5})
        assert names(plan) == [
            f"line-{level}-{frequency}"
            for level in ("0p5vpp", "1p5vpp")
            for frequency in ("200hz", "205hz", "210hz")
        ]
        assert [point.measurement.excitation.frequency_hz for point in plan.points()] == [200, 205, 210] * 2

    def test_the_order_key_changes_the_nesting_of_axes(self):
        plan = campaign(
            amplitude_vpp=[0.5, 1.5], frequency_hz=[200, 210], order=["frequency_hz", "amplitude_vpp"]
        )
        assert names(plan) == [f"line-{hz}hz-{level}vpp" for hz in (200, 210) for level in ("0p5", "1p5")]

    def test_repetitions_can_be_a_sweep_axis(self):
        plan = campaign(amplitude_vpp=[0.5], frequency_hz=[200, 210], repetitions=2)
        assert [name[:7] for name in names(plan)] == ["line-r1", "line-r1", "line-r2", "line-r2"]

    def test_each_excitation_of_a_sweep_combines_the_common_values_with_its_own_values(self):
        plan = campaign(
            measurement={"excitation": {"amplitude_vpp": 1.0, "settle_s": 0.5}},
            excitations=[SWEEP, {"kind": "stepped_sine", "frequencies_hz": [200, 210]}],
            direction=["up", "down"],
        )
        by_name = {point.name: point.measurement.excitation for point in plan.points()}
        assert by_name["line-sine_sweep-up"].start_hz == 200
        assert by_name["line-sine_sweep-down"].start_hz == 300
        assert by_name["line-stepped_sine-down"].direction == "down"
        assert {excitation.settle_s for excitation in by_name.values()} == {0.5}

    def test_measurements_come_before_sweeps_and_defaults_apply_to_both(self, tmp_path):
        path = tmp_path / "c.toml"
        path.write_text("""
name = "c"
[defaults]
ramp_s = 0.7
[defaults.dwell]
settle_s = 9.0
duration_s = 4.0
[[sweeps]]
name = "line"
frequency_hz = [200, 210]
measurement = { excitation = { kind = "dwell", amplitude_vpp = 1.0 } }
[[measurements]]
name = "first"
excitation = { kind = "dwell", amplitude_vpp = 1.0, frequency_hz = 260, settle_s = 1.0 }
""")
        points = load_campaign(path).points()
        assert [point.name for point in points] == ["first", "line-200hz", "line-210hz"]
        assert [point.measurement.excitation.settle_s for point in points] == [1.0, 9.0, 9.0]
        assert {point.measurement.ramp_s for point in points} == {0.7}

    def test_logarithmic_levels_have_equal_ratios(self):
        levels = {"start": 0.1, "stop": 1.0, "count": 3, "spacing": "logarithmic"}
        plan = campaign(amplitude_vpp=levels, frequency_hz=[200])
        found = [point.measurement.excitation.amplitude_vpp for point in plan.points()]
        assert found == pytest.approx([0.1, 0.1**0.5, 1.0])


class TestChains:
    def test_the_lead_in_of_a_point_passes_all_earlier_points_of_its_chain(self):
        plan = campaign(
            amplitude_vpp=[0.5],
            direction=["up", "down"],
            frequency_hz=[210, 200, 205],
            continue_from_previous="frequency_hz",
            lead_s=0.25,
        )
        ways = {
            point.name: [tone.frequency_hz for tone in point.measurement.excitation.lead_in]
            for point in plan.points()
        }
        assert ways == {
            "line-0p5vpp-up-200hz": [],
            "line-0p5vpp-up-205hz": [200],
            "line-0p5vpp-up-210hz": [200, 205],
            "line-0p5vpp-down-210hz": [],
            "line-0p5vpp-down-205hz": [210],
            "line-0p5vpp-down-200hz": [210, 205],
        }
        assert [point.chain for point in plan.points()] == ["line-0p5vpp-up"] * 3 + ["line-0p5vpp-down"] * 3
        assert {point.measurement.excitation.lead_s for point in plan.points()} == {0.25}

    def test_a_lead_in_of_limited_length_keeps_the_last_points(self):
        def pick(points, **bound):
            return campaign(
                amplitude_vpp=[0.5],
                frequency_hz={"start": 200, "step": 1, "stop": 199 + points},
                continue_from_previous="frequency_hz",
                **bound,
            )

        last = pick(40, lead_points=3).points()[-1].measurement.excitation
        assert [tone.frequency_hz for tone in last.lead_in] == [236, 237, 238]
        whole_s, bounded_s = ([pick(n, **b).duration_s for n in (20, 40)] for b in ({}, {"lead_points": 3}))
        assert bounded_s[1] - 2 * bounded_s[0] == pytest.approx(0.5 * 6)
        assert whole_s[1] - 2 * whole_s[0] == pytest.approx(0.5 * 20 * 20)
        assert len(pick(1200, lead_points=2).points()) == 1200

    def test_an_up_and_down_sweep_is_one_chain_of_points(self):
        plan = campaign(
            amplitude_vpp=[0.5],
            direction=["up_then_down"],
            frequency_hz=[200, 205],
            continue_from_previous="frequency_hz",
        )
        assert names(plan) == [
            f"line-0p5vpp-{word}" for word in ("up-200hz", "up-205hz", "down-205hz", "down-200hz")
        ]
        last = plan.points()[-1].measurement.excitation
        assert [tone.frequency_hz for tone in last.lead_in] == [200, 205, 205]

    def test_a_chain_of_falling_levels_is_checked_at_its_highest_level(self, rig):
        plan = campaign(
            measurement={"ramp_s": 0.3, "excitation": {**DWELL, "frequency_hz": 200}},
            amplitude_vpp=[0.5, 1.0, 2.0],
            direction=["down"],
            continue_from_previous="amplitude_vpp",
        )
        last = plan.points()[-1].measurement
        assert last.excitation.amplitude_vpp == 0.5
        assert last.excitation.highest_amplitude_vpp == 2.0
        playing = [phase.play.level for phase in phases(last) if phase.state is RunState.RECORDING]
        assert playing == [4.0, 2.0, 1.0]
        alone = plan.points()[0].measurement.excitation
        peak = predicted_loads(last.excitation, rig)[BaseQuantity.ACCELERATION].peak
        assert peak == pytest.approx(predicted_loads(alone, rig)[BaseQuantity.ACCELERATION].peak)
        require_within_limits(last, rig)

    def test_a_chain_is_unchanged_after_writing_and_reading_toml(self, tmp_path):
        plan = campaign(amplitude_vpp=[0.5], frequency_hz=[200, 205], continue_from_previous="frequency_hz")
        path = tmp_path / "c.toml"
        path.write_text(toml_text(plan))
        assert load_campaign(path).points() == plan.points()


def by(start, stop, step):
    return {"start": start, "stop": stop, "step": step}


POINT = {"frequency_hz": [200], "amplitude_vpp": [1]}


@pytest.mark.parametrize(
    ("sweep", "said"),
    [
        ({**POINT, "frequency_hz": [200, 200.00000001]}, "two measurements would be recorded as"),
        (
            {"frequency_hz": by(1, 1000, 1), "amplitude_vpp": by(0.1, 2, 0.1)},
            r"has 20000 points \(20 amplitude_vpp x 1000 frequency_hz\); at most 10000 are allowed",
        ),
        ({"frequency_hz": by(1, 1000, 1e-9)}, r"values \(at most 10000\)"),
        ({"frequency_hz": by(300, 200, 1)}, "is not above start"),
        ({"frequency_hz": [200]}, "line-200hz: excitation.dwell.amplitude_vpp is missing"),
        ({"frequency_hz": [200], "amplitude_vpp": [5000]}, "less than or equal to 1000"),
        ({**POINT, "order": ["frequency_hz"]}, "is missing 'amplitude_vpp'"),
        ({**POINT, "continue_from_previous": "amplitude_vpp"}, "must be the innermost axis"),
        ({**POINT, "continue_from_previous": "repetition"}, "is not an axis for a chain"),
        ({**POINT, "direction": ["up"]}, "has no meaning for the excitation 'dwell'"),
        (
            {
                "measurement": {"excitation": SWEEP},
                "amplitude_vpp": [1, 2],
                "continue_from_previous": "amplitude_vpp",
            },
            "works only for dwells",
        ),
        ({**POINT, "name": "x" * 60}, "give the sweep a shorter name"),
        ({**POINT, "command": "rm"}, "command is not a known key"),
        (
            {**POINT, "frequency_hz": by(1, 1200, 1), "continue_from_previous": "frequency_hz"},
            r"a chain would have 1200 points \(at most 1000\)",
        ),
    ],
)
def test_an_invalid_sweep_is_refused_with_the_allowed_values(sweep, said):
    with pytest.raises(ConfigurationError, match=said):
        campaign(**sweep)


def test_a_campaign_without_points_is_refused():
    with pytest.raises(ConfigurationError, match=r"at least one of \[\[measurements\]\] and \[\[sweeps\]\]"):
        validate({"name": "c"}, Campaign, "c.toml")
