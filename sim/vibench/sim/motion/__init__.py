"""One motion of one specimen: integrated, observed or sampled.

`integrate` returns a `Trajectory`. `steady_response` returns Responses I and II in the window at the end of a
run. `follow_samples` returns the motion at each sample of a recorded base motion. If a run cannot continue,
the `Outcome` of its result says why; no exception is raised (docs/decisions/0004-contact-integration.md).
"""
