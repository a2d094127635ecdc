"""Periodic motions, stable or not: harmonic balance, shooting, their branches, Floquet multipliers.

`first_order_states` finds all branches of the paper's analytical solution (Gong et al. 2025, eqs. 4 and 5).
`balance_branch_within` follows balances of any number of harmonics, `periodic_branch` exact motions
with impacts, along frequency or amplitude, through folds (pseudo-arclength continuation). The multipliers of
the variational equation give stability, folds, period doublings and Neimark-Sacker points.
The spring is a `RestoringForce` of p, the rest a linear structure condensed to p (Krack and Gross 2019).
"""
