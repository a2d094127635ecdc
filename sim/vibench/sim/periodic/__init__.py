"""Periodic motions, stable or not: harmonic balance, shooting, their branches, Floquet multipliers.

`first_order_states` finds all branches of the paper's analytical solution (Gong et al. 2025, eqs. 4 and 5).
`balance_branch_within` follows solutions of harmonic balance, `periodic_branch` exact motions with impacts,
both along frequency or amplitude and through folds (pseudo-arclength continuation). The multipliers of the
variational equation give stability, folds, period doublings and Neimark-Sacker points. The contact is a
`RestoringForce` of the relative displacement p; the linear rest is condensed to p (Krack and Gross 2019).
"""
