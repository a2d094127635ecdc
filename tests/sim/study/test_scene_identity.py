from dataclasses import replace

from vibench.sim import Accuracy, Harmonic, Observable, Rest, Scene, gong2025
from vibench.sim.scene.scene import AutomaticDuration, FixedDuration, Given
from vibench.sim.study._study import scene_identity

SCENE = Scene(
    gong2025(), Harmonic(260.0, 5e-6), (Observable.RESPONSE,), Accuracy.STANDARD, FixedDuration(), Rest()
)
STATE = (1e-6, 2e-6, 3e-6, 0.0, 0.0, 1e-3)
OTHERS = {
    "damping": replace(SCENE, specimen=gong2025(damping_time_s=2.0000000000000002e-5 * (1 + 2.3e-16))),
    "gap": replace(SCENE, specimen=gong2025(gap_m=(45e-6, 46e-6))),
    "one stop": replace(SCENE, specimen=gong2025(gap_m=(float("inf"), 45e-6))),
    "model": replace(SCENE, specimen=gong2025(contact="power:5")),
    "frequency": replace(SCENE, drive=Harmonic(260.00000000000006, 5e-6)),
    "amplitude": replace(SCENE, drive=Harmonic(260.0, 6e-6)),
    "phase": replace(SCENE, drive=Harmonic(260.0, 5e-6, 1.0)),
    "observe": replace(SCENE, observe=(Observable.RESPONSE, Observable.LYAPUNOV)),
    "accuracy": replace(SCENE, accuracy=Accuracy.QUICK),
    "duration": replace(SCENE, duration=FixedDuration(31.0)),
    "automatic": replace(SCENE, duration=AutomaticDuration()),
    "start": replace(SCENE, start=Given(STATE)),
}


def test_different_scenes_have_different_identities():
    identities = {name: scene_identity(scene) for name, scene in OTHERS.items()} | {"": scene_identity(SCENE)}
    assert len(set(identities.values())) == len(identities)


def test_equal_scenes_have_the_same_identity_however_they_are_constructed():
    again = Scene(gong2025(2e-5, 45e-6, "hertz"), Harmonic(260.0, 5e-6, 0.0))
    assert scene_identity(again) == scene_identity(SCENE)


def test_the_name_of_an_initial_state_does_not_change_the_scene_identity():
    one, other = (replace(SCENE, start=Given(STATE, name)) for name in ("kick", "push"))
    assert scene_identity(one) == scene_identity(other)


def test_a_continued_scene_is_identified_by_its_predecessor():
    one = replace(SCENE, start=Given(STATE), drive=Harmonic(260.0, 5e-6, 0.5))
    other = replace(SCENE, start=Given((0.0,) * 6), drive=Harmonic(260.0, 5e-6, 0.7))
    before = scene_identity(OTHERS["frequency"])
    assert scene_identity(one, before) == scene_identity(other, before)
    assert scene_identity(one, before) != scene_identity(one, scene_identity(SCENE))
    assert scene_identity(one, before) != scene_identity(one)
