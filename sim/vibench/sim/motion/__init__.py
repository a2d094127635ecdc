"""One motion of one specimen: integrated, observed, sampled, or reduced to one state per drive period.

`integrate` gives a `Trajectory`; `steady_response` Responses I and II over the window at the end of a run;
`follow_samples` a motion sample by sample of a recorded base. `poincare` finds the period of a
motion and the derivative of its flow. A run that cannot continue ends with an `Outcome`, not an exception
(docs/decisions/0004-contact-integration.md).
"""
