"""The Simulate page: a scene as a form, and its answer as it grows.

One process computes for as long as the window lives; what nobody wants any more is dropped.
Responses, exponents, similarity and motion are drawn while they come in.
"""
