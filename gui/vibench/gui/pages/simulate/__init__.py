"""The Simulate page: a form for the scene, and results that are drawn as they arrive.

A separate process computes the requests; outdated ones are dropped.
The results are responses, exponents, similarity and motion.
"""
