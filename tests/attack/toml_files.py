"""Broken TOML files of every kind that a command reads: campaigns, rigs, faults, studies, mappings."""

import random
from collections.abc import Mapping

from .command_attack import attack_commands
from .command_runner import ROOT
from .limits import Case
from .tally import Shard, Tally
from .text_mutants import mutate_toml

BROKEN = "broken.toml"
ESTIMATE = ("--out", "out", "--estimate", "--json")
SAMPLES = b"time [s],volts [V]\n" + b"".join(f"{k / 1000},{(k % 7) / 7}\n".encode() for k in range(3000))
MAPPING = """
started_utc = 2026-03-01T12:00:00Z
sample_rate_hz = 1000.0
origin = "real"
begins_s = 0.25
calibration_valid_days = 365
confirmations = { amplifier = "gain 3", gap_m = 45e-6 }
[specimen]
contact = "hertz"
damping_time_s = 2e-5
gap_m = 45e-6
[measurement]
name = "dwell"
excitation = { kind = "dwell", amplitude_vpp = 1, frequency_hz = 20, duration_s = 1, settle_s = 0 }
[[parts]]
start_s = 0.5
stop_s = 1.5
[[channels]]
source = "volts"
role = "drive_voltage"
full_scale = 5.0
[[channels]]
source = "1"
role = "time"
quantity = "time"
unit = "s"
scale = 2.0
offset = -1.0
delay_s = 1e-3
calibration_date = 2026-01-01
"""
SHORT_STUDY = """
models = ["hertz", "linear", "power:3+5"]
damping_times_s = [0.0, 2e-5]
gaps_m = [45e-6]
amplitudes_m = [1e-6, 5e-6]
frequencies_hz = [{ start = 180, stop = 200, step = 5 }, 260.0]
starts = ["rest", "up", { label = "mine", state = [0, 1e-5, 0, 0, 0, 0.1] }]
observe = ["response", "lyapunov"]
accuracy = "quick"
duration_s = "auto"
window_s = 0.5
[structure]
masses_kg = [5.8e-3, 2.1e-3, 2e-3]
single_frequencies_hz = [322, 100, 390.6]
hertz_stiffness = 4.9e9
"""


def _texts(pattern: str) -> tuple[str, ...]:
    return tuple(path.read_text(encoding="utf-8") for path in sorted(ROOT.glob(pattern)))


CAMPAIGNS = _texts("campaigns/*.toml")
RIGS = _texts("hardware_configs/*.toml")
FAULTS = _texts("hardware_configs/faults/*.toml")
STUDIES = (SHORT_STUDY, *_texts("studies/*.toml"))
KINDS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "campaign": (CAMPAIGNS, ("measure", BROKEN, *ESTIMATE)),
    "rig": (RIGS, ("measure", "good.toml", "--bench", BROKEN, *ESTIMATE)),
    "faults": (FAULTS, ("measure", "good.toml", "--faults", BROKEN, *ESTIMATE)),
    "study": (STUDIES, ("study", BROKEN, "--out", "answers.h5", "--estimate", "--json")),
    "mapping": ((MAPPING,), ("import", "samples.csv", "--mapping", BROKEN, "--out", "new.h5", "--json")),
}
"""For each kind: valid files to start from, and the command that reads it."""
GOOD = {"good.toml": (ROOT / "campaigns" / "quick.toml").read_bytes(), "samples.csv": SAMPLES}


def reading(kind: str, content: bytes) -> Case:
    """Return a case in which the command of a kind reads a file with this content."""
    return Case(KINDS[kind][1], {**GOOD, BROKEN: content})


def mutant(chance: random.Random) -> Case:
    """Break a file of a random kind."""
    kind = chance.choice(tuple(KINDS))
    texts, _ = KINDS[kind]
    return reading(kind, mutate_toml(chance.choice(texts), chance, texts))


def attack(shard: Shard) -> Tally:
    """Let commands read broken TOML files."""
    return attack_commands("toml", mutant, shard)
