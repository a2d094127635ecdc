"""One motion of one specimen: integrated, observed, sampled, or reduced to one state per drive period.

`integrate` gives a `Trajectory`; `steady_response` Responses I and II over the window at the end of a run;
`follow_samples` a motion sample by sample of a recorded base. Also the stroboscopic map with its scales and
the flow over a stretch with its derivative. A run that cannot go on ends with an `Outcome`, not an exception
(docs/decisions/0004-contact-integration.md).
"""
