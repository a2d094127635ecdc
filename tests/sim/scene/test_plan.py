import time

import numpy as np
import pytest

from vibench.sim import Harmonic, Observable, Scene, gong2025, integrate, plan_scene
from vibench.sim.scene.followed_run import FollowedRun, samples_between
from vibench.sim.scene.plan import CLOSED_FORM_S
from vibench.sim.scene.prediction import Method
from vibench.sim.scene.scene import AutomaticDuration, FixedDuration, Given

QUIET, LOUD = Harmonic(200.0, 1e-6), Harmonic(260.0, 5e-6)


@pytest.mark.parametrize("contact", ["hertz", "linear_gap", "rigid:0.8", "linear"])
@pytest.mark.parametrize("duration", [FixedDuration(), AutomaticDuration()], ids=["fixed", "automatic"])
def test_provably_contact_free_motion_is_planned_in_closed_form(contact, duration):
    plan = plan_scene(Scene(gong2025(contact=contact), QUIET, duration=duration))
    assert plan.method is Method.CLOSED_FORM
    assert "closed form" in plan.explain()


def test_a_transient_that_may_touch_a_stop_is_integrated():
    specimen = gong2025()
    begins_fast = Given((0.0, 0.0, 0.0, 0.0, 0.5, 0.0))
    plan = plan_scene(Scene(specimen, QUIET, start=begins_fast))
    assert plan.method is Method.EVENT_DRIVEN
    assert "A stop may be touched" in plan.explain()


def test_a_transient_that_lasts_into_the_window_is_integrated():
    short = plan_scene(Scene(gong2025(), QUIET, duration=FixedDuration(0.2, 0.1)))
    undamped = plan_scene(Scene(gong2025(damping_time_s=0.0), QUIET))
    for plan in (short, undamped):
        assert plan.method is Method.EVENT_DRIVEN
        assert "has not decayed" in plan.explain()


def test_a_contact_law_with_a_force_at_every_displacement_is_always_integrated():
    assert plan_scene(Scene(gong2025(contact="power:7"), QUIET)).method is Method.POLYNOMIAL


@pytest.mark.parametrize(
    ("observable", "said"),
    [
        (Observable.LYAPUNOV, "A tangent vector is computed for the exponent."),
        (Observable.SPECTRUM, "Samples are stored over the window"),
        (Observable.SCATTER, "show the scatter"),
    ],
)
def test_a_scene_plan_computes_only_requested_observables(observable, said):
    plain = plan_scene(Scene(gong2025(), LOUD))
    asked = plan_scene(Scene(gong2025(), LOUD, observe=(Observable.RESPONSE, observable)))
    assert said not in plain.explain()
    assert said in asked.explain()
    assert asked.planned_s >= plain.planned_s


def test_the_planned_cost_without_contact_grows_with_the_drive_periods():
    def cost(frequency_hz):
        drive = Harmonic(frequency_hz, 1e-9)
        length = FixedDuration(2.0, 1.9)
        return plan_scene(Scene(gong2025(), drive, duration=length, budget_s=0.0)).planned_s

    assert cost(1e6) > 30.0 * cost(1e4)


@pytest.mark.parametrize("contact", ["power:3", "power:7", "power:47", "power:3+5+7"])
@pytest.mark.parametrize("drive", [Harmonic(130.0, 2e-5), LOUD, Harmonic(600.0, 2e-6), Harmonic(266.0, 1e-4)])
def test_the_planned_cost_of_power_laws_agrees_with_their_nominal_cost(contact, drive):
    """At large levels, power:47 was planned at a sixth of its cost."""
    run = FollowedRun(gong2025(contact=contact), drive, 1e-7, np.zeros(6))
    run.follow(0.5, samples=samples_between(drive.frequency_hz, 0.0, 0.5))
    length = FixedDuration(0.5, 0.1)
    planned_s = plan_scene(Scene(gong2025(contact=contact), drive, duration=length, budget_s=0.0)).planned_s
    assert 0.4 < (planned_s - CLOSED_FORM_S) / run.cost_s < 2.5


@pytest.mark.thorough
@pytest.mark.parametrize("is_sensitive", [False, True], ids=["", "with a tangent"])
def test_nominal_costs_of_all_contact_laws_are_proportional_to_processor_time(is_sensitive):
    """For polynomial forces, budgets of 0.2 s took 2 to 4 s: costs did not depend on the number of steps."""

    def taken_over_nominal(contact):
        run = FollowedRun(gong2025(2e-5, 20e-6, contact), Harmonic(266.0, 20e-6), 1e-7, np.zeros(6))
        run.follow(0.5)
        if is_sensitive:
            run.follow_tangent()
        cost_s, begins_s = run.cost_s, time.thread_time()
        run.follow(1.5, samples=samples_between(266.0, 0.5, 1.5))
        return (time.thread_time() - begins_s) / (run.cost_s - cost_s)

    laws = ("hertz", "hunt_crossley:0.3", "linear_gap", "rigid:0.5", "power:3", "power:7", "power:47")
    ratios = [min(taken_over_nominal(law) for _ in range(3)) for law in laws]
    assert max(ratios) < 4.0 * min(ratios)


@pytest.mark.thorough
def test_the_cost_of_enormous_levels_grows_as_planned():
    """Relative to the plan, levels of 1 to 20 m took 14 times as long as 10 um."""

    def taken_over_planned(amplitude_m):
        drive, length = Harmonic(200.0, amplitude_m), FixedDuration(1.0, 0.1)
        planned_s = plan_scene(Scene(gong2025(), drive, duration=length, budget_s=0.0)).planned_s
        begins_s = time.thread_time()
        integrate(gong2025(), drive, length.duration_s)
        return (time.thread_time() - begins_s) / (planned_s - CLOSED_FORM_S)

    usual, *enormous = (min(taken_over_planned(each) for _ in range(3)) for each in (1e-5, 1e-3, 1.0, 20.0))
    for each in enormous:
        assert 0.2 < each / usual < 5.0
