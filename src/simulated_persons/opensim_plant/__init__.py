"""A second plant: persons simulated by OpenSim, on the scaled model that the study exports.

Skeleton, paths and wrapping, inverse dynamics, muscles and their activation dynamics are OpenSim's:
``Millard2012EquilibriumMuscle`` with elastic tendons (Millard et al. 2013, J Biomech Eng 135:
021005), whose fibres are in equilibrium with their tendons at every frame. How the load is shared
among muscles is this package's own. Nothing is fitted to the study's equations; only the anatomy is
the same. Records are spoilt as those of the other plant are.

`arm`, `effects` and `trials` belong to the process that draws cases; `process`, `skeleton`,
`outside` and `sharing` to one of its own, because opensim cannot share a process with casadi.
"""
