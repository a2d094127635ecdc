"""The Simulate page: a form for the scene, and results that are drawn as they arrive.

The results are responses, exponents, similarity of models, and motions. A separate process computes them; a
new request cancels the earlier request.
"""
