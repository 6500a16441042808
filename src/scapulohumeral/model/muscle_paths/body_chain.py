"""Where each body is in the chain from thorax to hand.

A module of its own, without opensim and without casadi: who needs one of the two may use it.
"""

# Links of the chain, thorax first. Of SC, AC, GH and EL, joint k lies between places k and k + 1.
CHAIN_POSITION = {
    "thorax": 0,
    "clavicle_r": 1,
    "scapula_r": 2,
    "humerus_r": 3,
    "ulna_r": 4,
    "radius_r": 4,
    "hand_r": 4,
}
