"""Simulations that a person asks for: what is asked, how the answer grows, and what it costs.

One specimen, one drive over frequency, up to two models; answers come piece by piece from a process of
their own, which computes one request after another and can be told to stop. Errors and costs of each
accuracy are those of docs/accuracy.md.

>>> from vibench.analysis.prediction.progress import SimulationRequest
>>> from vibench.analysis.prediction.accuracy_cost import cost_sentences
>>> request = SimulationRequest(start_hz=250.0, stop_hz=270.0, step_hz=5.0)
>>> request.models, request.points
(('hertz', 'linear'), 10)
>>> cost_sentences(request, cores=2)[0].partition(":")[0]
'10 points of 8 s on 2 idle cores'
"""
