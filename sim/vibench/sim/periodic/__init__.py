"""Stable and unstable periodic motions: harmonic balance, shooting, branches, Floquet multipliers.

`first_order_states` finds all branches of the paper's analytical solution (Gong et al. 2025, eqs. 4 and 5).
`balance_branch_within` follows harmonic-balance solutions; `periodic_branch` follows exact motions with
impacts. Both use pseudo-arclength continuation in frequency or amplitude. Floquet multipliers give stability,
folds, period doublings and Neimark-Sacker points. In harmonic balance, the contact is a `RestoringForce` that
depends on p, and the linear part of the specimen is condensed to p (Krack and Gross 2019).
"""
