"""The Simulate page: a scene as a form, and its answer as it grows.

One process computes for as long as the window lives; outdated requests are dropped.
Responses, exponents, similarity and motion are drawn as they arrive.
"""
