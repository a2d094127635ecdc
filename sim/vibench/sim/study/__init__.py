"""Studies: every combination of models, gaps, amplitudes and frequencies, solved as one queue of scenes.

`solve_study` computes on threads or on a Dask cluster and stores the results in memory or in an HDF5 file.
The file stays valid if the process is killed, and the study can be resumed from the file (docs/studies.md,
docs/decisions/0010-studies.md). With the start `up` or `down`, a point starts from the final state at the
neighbouring frequency. Results do not depend on the computer; the file names the software that computed them.

>>> from vibench.sim.study import Study, frequency_range, solve_study
>>> study = Study(models=["linear"], frequencies_hz=frequency_range(90.0, 100.0, 5.0), amplitudes_m=[1e-6])
>>> results = solve_study(study)
>>> results.is_complete
True
>>> [round(float(value), 3) for value in results.values("response_i", model="linear").ravel()]
[1.527, 2.541, 0.715]
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
