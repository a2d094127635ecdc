"""HDF5 recordings: layout, writing, finishing, recovery and reading.

During the run the file is ``NAME.h5.part``. A writer thread writes the samples, syncs the disk, then updates
the counters of valid samples. If the process is killed or the power is cut, at most the last second is lost.
The finished ``NAME.h5`` is compressed and has checksums; no existing file is overwritten. Samples are int32
counts of the A/D converter, with scale factors to SI units; lost samples are marked. Format:
docs/recording-format.md; reasons: docs/decisions/0003-recording-format.md and 0020.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> import numpy as np
>>> from vibench.acquisition import Block, open_recording
>>> from vibench.acquisition.recording import (
...     ChannelHeader, Origin, RecordingHeader, RecordingState, create_recording
... )
>>> channel = ChannelHeader(
...     "m0_velocity", "Dev1/ai0", "velocity", "m s-1", physical_per_volt=0.125, range_v=5.0
... )
>>> header = RecordingHeader((channel,), 1000.0, expected_samples=500, origin=Origin.SIMULATED)
>>> with TemporaryDirectory() as folder:
...     with create_recording(Path(folder) / "sine.h5", header) as writer:
...         writer.append(Block(0, np.sin(0.1 * np.arange(500))[np.newaxis]))
...         path = writer.finish(RecordingState.COMPLETE)
...     with open_recording(path) as recording:
...         print(recording.state.value, recording.samples, f"{recording.read('m0_velocity').max():.3f}")
complete 500 0.125
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
