"""From a start to a solution: IPOPT, meshes from coarse to fine, checkpoints."""
