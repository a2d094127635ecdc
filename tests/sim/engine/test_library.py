"""The library of the native engine: located, checked, rebuilt, and equal on every processor family."""

import importlib.util
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from tests.sim.engine.native_calls import calls
from vibench.sim import Harmonic, gong2025
from vibench.sim.engine.batch import follow_batch
from vibench.sim.engine.library import Engine, EngineError, library_path, parse_structures
from vibench.sim.engine.processor import usable_families
from vibench.sim.engine.run import NativeRun, RunRecord, Watch, check_known_answer, native_engine
from vibench.sim.engine.scene import collision_structure, power_structure, scene_of

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def build():
    spec = importlib.util.spec_from_file_location("native_build", ROOT / "native" / "build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def final_motions(engine):
    for law in ("hertz", "hunt_crossley:0.5", "linear_gap", "rigid:0.8", "power:5", "power:3+5+7"):
        for drive in (Harmonic(130.0, 20e-6), Harmonic(260.0, 5e-6)):
            run = NativeRun(gong2025(contact=law), drive, np.zeros(6), 3e-7, engine=engine)
            record = RunRecord(10_000, engine=engine)
            record.watch(Watch.PEAKS_AND_LINES)
            run.carry(np.eye(6))
            run.advance(0.1, record)
            seen = (record.peak_x_m, record.peak_p_m, record.area_x.real, record.area_p.imag)
            yield np.concatenate([run.motion, seen, np.ravel(run.changes)])


@pytest.mark.thorough
def test_batches_give_identical_results_for_every_register_width(build):
    families = [each for each in usable_families() if each != "x86_64"]  # x86_64 has no fused multiply-add
    starts = np.random.default_rng(1).uniform(-1.0, 1.0, (24, 6)) * np.repeat([1.5e-5, 0.05], 3)
    answers = []
    for engine in [Engine(build.compile_engine(family)) for family in families]:
        runs = [
            NativeRun(gong2025(), Harmonic(60.0 + 15.0 * k, 2e-5), start, 3e-7, engine=engine)
            for k, start in enumerate(starts)
        ]
        found = follow_batch(runs, [10 + 5 * k for k in range(24)], Watch.PEAKS_AND_LINES)
        assert sum(each.impacts for each in found) > 1000
        seen = [(each.peak_x_m, each.peak_p_m, each.area_x.real, each.area_p.imag) for each in found]
        motions = [*(each.states for each in found), [run.motion for run in runs]]
        answers.append(np.concatenate([np.ravel(seen), np.ravel(np.concatenate(motions))]))
    for answer in answers[1:]:
        assert np.array_equal(answer, answers[0])


@pytest.mark.thorough
def test_the_engine_gives_identical_results_for_every_processor_family(build):
    engines = [Engine(build.compile_engine(family)) for family in usable_families()]
    for engine in engines:
        check_known_answer(engine)
    answers = [np.array(list(final_motions(engine))) for engine in engines]
    for answer in answers[1:]:
        assert np.array_equal(answer, answers[0])
    for seed in range(5):
        draws = [np.random.default_rng(seed) for _ in engines]
        for same in zip(*(calls(*each) for each in zip(engines, draws, strict=True)), strict=True):
            codes = [each.call(name, given) for each, (name, given, _) in zip(engines, same, strict=True)]
            assert codes == codes[:1] * len(codes)
            for filled in zip(*(arrays for _, _, arrays in same), strict=True):
                assert all(np.array_equal(each, filled[0], equal_nan=True) for each in filled)
                assert np.any(filled[0])


def test_the_loaded_engine_is_built_from_the_sources_of_this_checkout(build):
    engine = native_engine()
    assert engine.path == build.compile_engine(engine.family)
    assert engine.path.stat().st_size < 3_000_000


def test_an_engine_with_wrong_results_is_refused(monkeypatch):
    monkeypatch.setattr("vibench.sim.engine.run.KNOWN_DURATION_S", 0.0301)
    with pytest.raises(EngineError, match="fails its self-test"):
        check_known_answer(native_engine())


def test_structures_match_the_compiled_header():
    types = parse_structures(
        ["Inner { double a, b; Phasor c[2]; }", "Outer { int64_t n; Inner d[3]; const Inner *e; }"]
    )
    assert types["Outer"].itemsize == 8 + 3 * (2 * 8 + 2 * 16) + 8
    assert types["Outer"]["d"].shape == (3,)
    with pytest.raises(ValueError, match="is not a structure of the native engine"):
        parse_structures(["double a;"])
    with pytest.raises(ValueError, match="is not a field"):
        parse_structures(["Inner { double a-b; }"])


def test_arrays_of_wrong_size_or_type_are_refused_by_the_engine():
    engine = native_engine()
    arrays = {"samples": np.ones(9), "positions": np.ones(5), "table": np.ones((4, 64)), "values": np.ones(5)}
    for name, found in (("positions", np.ones(4)), ("table", np.ones(256 + 1)), ("samples", np.ones(9))):
        channels = 2 if name == "samples" else 1
        with pytest.raises(ValueError, match="refuses to interpolate: array sizes must agree"):
            engine.call(
                "interpolate", engine.new("Interpolation", channels=channels, **arrays | {name: found})
            )
    nothing = arrays | {"positions": np.empty(0), "values": np.empty(0)}
    assert engine.call("interpolate", engine.new("Interpolation", channels=1, **nothing)) == 0
    for wrong in (np.ones(9, np.float32), np.ones(18)[::2]):
        with pytest.raises(TypeError, match="the native engine takes contiguous float64 arrays"):
            engine.new("Interpolation", **arrays | {"samples": wrong})


def test_a_scene_with_impossible_values_is_refused():
    engine, specimen = native_engine(), gong2025()
    scene = scene_of(engine, specimen, Harmonic(130.0, 20e-6))
    scene["specimen"]["m0"] = np.nan
    with pytest.raises(ValueError, match="scene is not allowed"):
        engine.prepare(scene)


def test_a_run_to_a_nan_time_is_refused():
    run = NativeRun(gong2025(), Harmonic(130.0, 20e-6), np.zeros(6), 3e-7)
    with pytest.raises(ValueError, match="end time must be finite"):
        run.advance(np.nan, RunRecord(0))
    with pytest.raises(ValueError, match="tolerance"):
        NativeRun(gong2025(), Harmonic(130.0, 20e-6), np.zeros(6), 0.0)


def test_an_engine_older_than_its_sources_is_refused_with_the_build_command(tmp_path, monkeypatch):
    older = tmp_path / "engine-x86_64-000000000000.so"
    older.touch()
    monkeypatch.setattr("vibench.sim.engine.library.FOLDER", tmp_path)
    monkeypatch.setattr("importlib.util.find_spec", lambda _name: None)
    with pytest.raises(
        EngineError, match=r"older than its sources: run pip install ziglang && python native/build\.py"
    ):
        library_path()


def test_an_installed_engine_needs_no_sources(tmp_path, monkeypatch):
    family = usable_families()[-1]
    ending = native_engine().path.suffix
    installed = tmp_path / f"engine-{family}-000000000000{ending}"
    installed.touch()
    (tmp_path / f"engine-{family}-000000000000.another_system").touch()
    monkeypatch.setattr("vibench.sim.engine.library.FOLDER", tmp_path)
    monkeypatch.setattr("vibench.sim.engine.library.BUILD", tmp_path / "absent.py")
    assert library_path() == installed
    installed.unlink()
    with pytest.raises(EngineError, match="install vibench again"):
        library_path()


def test_concurrent_first_requests_share_one_collision_table():
    """Runs refer to the table; a second table was once freed while in use, and results were wrong."""
    engine, threads = Engine(library_path()), 8
    start = threading.Barrier(threads)

    def places(_):
        start.wait()
        return collision_structure(engine).ctypes.data, power_structure(engine).ctypes.data

    with ThreadPoolExecutor(threads) as pool:
        assert len(set(pool.map(places, range(threads)))) == 1
