"""Settings for all tests: one thread for linear algebra, and window tests wherever Qt can be loaded."""

import gc
import os
import tempfile
from importlib.util import find_spec

import hypothesis
import pytest

import vibench.cli.environment  # noqa: F401 - it is the import that counts, before any test imports numpy

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ.setdefault("QT_SCALE_FACTOR", "1")
os.environ.setdefault("PYQTGRAPH_QT_LIB", "PySide6")

# The duration of an example depends on the load of the computer.
hypothesis.settings.register_profile(
    "busy", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("busy")

# Tests use a separate state folder and never change a user's bench checks; child processes inherit it.
_state_folder = tempfile.TemporaryDirectory(prefix="vibench_state_")
os.environ["VIBENCH_STATE_DIR"] = os.environ["VIBENCH_LOCK_DIR"] = _state_folder.name

# pytest-qt ends the whole test run where Qt's system libraries are missing, so it is loaded only if Qt loads.
QT_MISSING = ""
try:
    from PySide6 import QtGui, QtTest, QtWidgets  # noqa: F401 - to see whether they load
except ImportError as error:
    if os.environ.get("REQUIRE_GUI") == "1":
        raise
    QT_MISSING = str(error)
    collect_ignore_glob = ["gui/*"]
else:
    collect_ignore_glob = []
    pytest_plugins = ["pytestqt.plugin"]
MISSING = [each for each in ("fast_loop", "more_drivers") if find_spec(f"vibench_{each}") is None]
collect_ignore_glob += [f"extensions/{each}/*" for each in MISSING]


def pytest_report_header() -> str:
    """Report when the tests of the window or of an extension are not run."""
    window = "the window is tested offscreen"
    if QT_MISSING:
        window = (
            f"the window's tests were NOT RUN: Qt cannot be loaded ({QT_MISSING}); docs/gui.md names packages"
        )
    missing = (f"; those of {each} were NOT RUN: pip install -e extensions/{each}" for each in MISSING)
    return window + "".join(missing)


LONG = (
    "tests/robot/test_robot.py",
    "tests/cli/test_demo.py",
    "tests/sim/chain/test_integrate.py",
    "tests/sim/exponents/test_lyapunov_spectrum.py",
    "tests/sim/exponents/test_tangent.py",
    "tests/cli/test_killed_campaign.py",
    "tests/sim/branches/test_shooting_branches.py",
    "tests/sim/branches/test_known_folds.py",
    "tests/analysis/dynamics/test_dynamics.py",
    "tests/analysis/hidden_motion/test_hidden_motion.py",
    "tests/analysis/overlay/test_twin.py",
    "tests/gui/pages/files/test_hidden_motion_view.py",
    "tests/test_on_windows.py",
    "tests/cli/test_chain_command.py",
    "tests/analysis/dynamics/test_branches_over_recordings.py",
    "tests/cli/test_dynamics_commands.py",
    "tests/gui/pages/simulate/test_dynamics_tabs.py",
    "tests/gui/pages/compare/test_compare_page.py",
    "tests/acquisition/engine/test_engine_process.py",
    "tests/acquisition/run/test_stop_matrix.py",
    "tests/gui/test_killed_window.py",
    "tests/acquisition/run/test_run_on_virtual_rig.py",
    "tests/acquisition/run/test_until.py",
    "tests/gui/pages/test_event_loop_blocking.py",
    "tests/cli/test_command_line.py",
    "tests/gui/test_accessibility.py",
    "tests/gui/test_job.py",
    "tests/acquisition/control/test_on_virtual_rig.py",
    "tests/acquisition/control/test_feedback_controllers.py",
    "tests/extensions/fast_loop/test_continuation.py",
    "tests/acquisition/campaign/test_damaged_recordings.py",
    "tests/acquisition/campaign/test_unattended.py",
    "tests/analysis/frequency_response/test_noise_request.py",
    "tests/paper/test_paper_figures.py",
    "tests/paper/test_textbook_methods.py",
    "tests/cli/test_watch.py",
    "tests/analysis/sine/test_jumps.py",
    "tests/cli/test_study.py",
    "tests/analysis/report/test_report.py",
    "tests/acquisition/run/test_stream_faults.py",
    "tests/acquisition/bench/test_bench.py",
    "tests/acquisition/drivers/test_daqmx_output.py",
    "tests/acquisition/contract/test_plug_ins.py",
    "tests/extensions/more_drivers/test_sound_card.py",
    "tests/acquisition/control/test_noise_controller.py",
    "tests/cli/test_bench_new.py",
    "tests/extensions/more_drivers/test_file_player.py",
    "tests/acquisition/check/test_bench_report.py",
    "tests/sim/study/test_cluster.py",
    "tests/virtual_rig/rig/test_virtual_rig.py",
    "tests/acquisition/run/test_stream_on_virtual_rig.py",
    "tests/analysis/sine/test_collision_region.py",
    "tests/virtual_rig/rig/test_fault_script.py",
    "tests/acquisition/check/test_admission.py",
    "tests/analysis/chaos/test_witnesses.py",
    "tests/acquisition/recording/test_kill.py",
    "tests/gui/window/test_window.py",
    "tests/gui/plots/test_logical_line.py",
    "tests/paper/test_reproduction.py",
    "tests/acquisition/engine/test_reliable_stop.py",
    "tests/acquisition/engine/test_time_to_silence.py",
    "tests/acquisition/run/test_disks.py",
    "tests/analysis/frequency_response/test_noise_response.py",
    "tests/cli/test_campaign_commands.py",
    "tests/sim/test_extremes.py",
    "tests/sim/study/test_kill.py",
    "tests/cli/test_analyse.py",
    "tests/cli/test_analyse_hidden.py",
    "tests/cli/test_environment.py",
    "tests/analysis/figures/test_figures.py",
    "tests/sim/rigid/test_rigid_stops.py",
    "tests/gui/pages/simulate/test_simulate_page.py",
    "tests/analysis/fit/test_updated_specimen.py",
    "tests/acquisition/campaign/test_documented_script.py",
    "tests/acquisition/bench/test_bench_list.py",
    "tests/sim/periodic/test_balance_branch.py",
    "tests/virtual_rig/usb/test_usb_bus.py",
    "tests/analysis/overlay/test_measurement_prediction.py",
    "tests/analysis/prediction/test_simulation.py",
    "tests/acquisition/recording/test_commit_order.py",
    "tests/analysis/exchange/test_times_of_files.py",
    "tests/analysis/recordings/test_response.py",
    "tests/analysis/frequency_response/test_resonance.py",
    "tests/analysis/fit/test_specimen_fit.py",
    "tests/analysis/exchange/test_import.py",
    "tests/analysis/hidden_motion/test_live_twin.py",
    "tests/analysis/recordings/test_dropouts.py",
    "tests/analysis/chaos/test_verdict.py",
    "tests/sim/accuracy_benchmark/test_measuring.py",
    "tests/sim/test_contact_laws_in_motion.py",
    "tests/sim/test_properties.py",
    "tests/sim/engine/test_observers.py",
    "tests/sim/accuracy_benchmark/test_independent_solution.py",
    "tests/extensions/fast_loop/test_feedback.py",
    "tests/gui/pages/files/test_files_page.py",
    "tests/analysis/sine/test_level_jumps.py",
    "tests/paper/test_options.py",
    "tests/acquisition/recording/test_seal.py",
    "tests/attack/test_system_calls.py",
    "tests/analysis/report/test_accuracy_document.py",
    "tests/sim/test_public_api.py",
    "tests/test_wheel.py",
    "tests/test_examples.py",
)
"""Files that take over three seconds, in starting order: a long file started last would run alone.

All other files are quick.
"""


ON_PURPOSE = ("slow", "hardware", "attack")
"""Marks of tests that run only when -m requests them."""
THOROUGH = "thorough"
"""Mark of tests that a full run omits; naming a file or folder includes them."""


def pytest_configure(config: pytest.Config) -> None:
    """Choose the tests that run without -m, and keep the file order of `LONG` for parallel runs."""
    asked = config.option.markexpr
    if asked in ("", THOROUGH):
        names_a_path = config.args_source is config.ArgsSource.ARGS
        left_out = ON_PURPOSE if asked or names_a_path else (THOROUGH, *ON_PURPOSE)
        config.option.markexpr = " and ".join(filter(None, (asked, *(f"not {mark}" for mark in left_out))))
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False
    gc.disable()


def pytest_collection_finish() -> None:
    """Exclude the half a million objects of imported modules from garbage collection."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort the longest test files first, and mark the quick tests."""
    place = {name: number for number, name in enumerate(LONG)}
    items.sort(key=lambda item: place.get(item.nodeid.partition("::")[0], len(place)))
    for item in items:
        is_long = item.nodeid.partition("::")[0] in place
        if not is_long and not any(item.get_closest_marker(name) for name in (THOROUGH, *ON_PURPOSE)):
            item.add_marker("quick")
