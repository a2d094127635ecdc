"""Measure a campaign on the virtual rig, and print the resonances of m0 found in its noise recording.

python examples/campaign_on_the_virtual_rig.py recordings
"""

import sys
from pathlib import Path

from vibench.acquisition import load_campaign, open_bench, open_recording, run_campaign, shipped
from vibench.analysis import analyse

campaign = load_campaign(shipped("campaigns/quick.toml"))
with open_bench(shipped("hardware_configs/virtual_rig.toml")) as bench:
    points = run_campaign(bench, campaign, Path(sys.argv[1]))

for point in points:
    print(f"{point.path.name}: {point.outcome.value}")

with open_recording(points[0].path) as recording:
    noise = analyse(recording).response
for peak in noise.resonances:
    print(f"resonance at {peak.frequency_hz:.1f} ± {peak.sd_frequency_hz:.1f} Hz")
