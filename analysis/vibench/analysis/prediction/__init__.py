"""Simulations for the window: requests, results as they arrive, and computing times.

A request has one specimen, one drive over frequency, and up to two models. A separate process computes one
request after the other and sends results in pieces; requests can be cancelled. docs/accuracy.md shows error
and computing time of each accuracy.

>>> from vibench.analysis.prediction.progress import SimulationRequest
>>> from vibench.analysis.prediction.progress import cost_sentences
>>> request = SimulationRequest(start_hz=250.0, stop_hz=270.0, step_hz=5.0)
>>> request.models, request.points
(('hertz', 'linear'), 10)
>>> cost_sentences(request, cores=2)[0].partition(":")[0]
'10 points of 8 s on 2 idle cores'
"""
