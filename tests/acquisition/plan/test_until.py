"""Results that a plan may wait for, and plans with `until` that are refused."""

import pytest
from pydantic import ValidationError

from vibench.acquisition.plan import Measurement

BAND = {"amplitude_vpp": 0.1, "band_start_hz": 20, "band_stop_hz": 800}
KINDS = {
    "white_noise": BAND,
    "odd_multisine": BAND,
    "streamed_noise": BAND | {"duration_s": 60},
    "dwell": {"amplitude_vpp": 0.1, "frequency_hz": 200, "duration_s": 60},
    "stepped_sine": {"amplitude_vpp": 0.1, "frequencies_hz": [150, 160]},
    "sine_sweep": {"amplitude_vpp": 0.1, "start_hz": 200, "stop_hz": 210, "duration_s": 60},
    "stepped_level": {"amplitude_vpp": 0.2, "frequency_hz": 200, "lowest_vpp": 0.1, "step_vpp": 0.05},
    "settled_sine": {"amplitude_vpp": 0.1, "frequencies_hz": [150, 160]},
    "held_noise": BAND | {"spectrum": [{"frequency_hz": 20, "density": 0.01}]},
}
NOISE, SINE = {"resonance_hz", "transmissibility"}, {"response_i", "response_ii"}
ALLOWED = {
    "white_noise": NOISE,
    "odd_multisine": NOISE,
    "streamed_noise": NOISE,
    "dwell": SINE,
    "stepped_sine": SINE,
}


def plan(kind, until):
    return Measurement.model_validate(
        {"name": "a", "excitation": {"kind": kind, **KINDS[kind]}, "until": until}
    )


@pytest.mark.parametrize("kind", sorted(KINDS))
@pytest.mark.parametrize("name", sorted(NOISE | SINE))
def test_the_key_until_accepts_only_results_of_the_excitation(kind, name):
    if name in ALLOWED.get(kind, set()):
        assert plan(kind, {name: "1 %"}).until.required_bounds == {name: 0.01}
        return
    with pytest.raises(ValidationError, match=f"'until' contains {name}, which {kind} does not support"):
        plan(kind, {name: "1 %"})


@pytest.mark.parametrize(("said", "meant"), [("0.1 %", 0.001), ("2%", 0.02), ("1e-3 %", 1e-5), (0.05, 0.05)])
def test_a_bound_of_until_may_be_a_percentage_or_a_fraction(said, meant):
    until = plan("dwell", {"response_i": said}).until
    assert until.response_i == pytest.approx(meant)
    assert type(until).model_validate_json(until.model_dump_json()) == until


@pytest.mark.parametrize("said", ["1", "1.2.3 %", "-1 %", "0 %", "100 %", "nan %", True, 0, 1.5, "", "٣ %"])
def test_an_invalid_bound_of_until_is_refused(said):
    with pytest.raises(ValidationError):
        plan("dwell", {"response_i": said})


def test_the_key_until_without_a_bound_is_refused():
    with pytest.raises(ValidationError, match="'until' names no result"):
        plan("dwell", {"shortest_s": 3.0})


def test_a_plan_without_the_key_until_is_accepted():
    assert plan("dwell", None).until is None
    assert (
        Measurement.model_validate({"name": "a", "excitation": {"kind": "dwell", **KINDS["dwell"]}}).until
        is None
    )


@pytest.mark.parametrize(("kind", "most_s"), [("dwell", 60), ("streamed_noise", 60), ("stepped_sine", 2)])
def test_a_shortest_time_above_the_planned_recording_time_is_refused(kind, most_s):
    """Steps shorter than the default of 2 s are analysed at their end if the plan gives no shortest_s."""
    name = sorted(ALLOWED[kind])[0]
    assert plan(kind, {name: "1 %", "shortest_s": most_s}).until.shortest_s == most_s
    with pytest.raises(ValidationError, match=r"until\.shortest_s = .* is longer than the"):
        plan(kind, {name: "1 %", "shortest_s": 1.01 * most_s})
