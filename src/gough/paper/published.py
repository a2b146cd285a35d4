"""The numbers that the paper prints.

Source: Zhu et al., "DisGNet: A Distance Graph Neural Network for Forward Kinematics Learning of
Gough-Stewart Platform", tables I and II and the supplement's tables. Trained for 1200 epochs and
timed on one RTX 3090.
"""

from __future__ import annotations

from dataclasses import dataclass

NETWORKS = ("plain-mlp", "wise-mlp", "gcn", "graphmlp", "disgnet")  # in the paper's order


@dataclass(frozen=True)
class Network:
    """Table I: parameters, E-trans [mm], E-rot [deg], E-ik [mm], seconds for 1000 samples."""

    parameters: float
    trans: float
    rot: float
    ik: float
    seconds: float


TABLE = {
    "plain-mlp": Network(0.13e6, 2.03, 6.13, 36.50, 0.0217),
    "wise-mlp": Network(0.13e6, 2.41, 0.64, 1.72, 0.0293),
    "gcn": Network(0.13e6, 1.82, 0.57, 1.48, 0.0525),
    "graphmlp": Network(0.35e6, 1.43, 0.44, 1.19, 0.1026),
    "disgnet": Network(0.13e6, 1.45, 0.41, 1.14, 0.0814),
}

# training set -> network -> translation median, mean, % below 0.5 and 1 mm; the same for rotation
SETS: dict[str, dict[str, tuple[float, ...]]] = {
    "full": {
        "plain-mlp": (0.72, 1.01, 33.2, 61.4, 5.25, 6.13, 1.7, 7.6),
        "wise-mlp": (0.89, 1.32, 26.7, 54.6, 0.50, 0.64, 72.4, 94.3),
        "gcn": (0.68, 0.96, 41.5, 71.3, 0.42, 0.57, 76.4, 95.1),
        "graphmlp": (0.48, 0.73, 52.4, 80.5, 0.34, 0.44, 85.6, 98.0),
        "disgnet": (0.48, 0.75, 51.7, 79.8, 0.35, 0.41, 85.1, 98.2),
    },
    "90": {
        "plain-mlp": (0.84, 1.28, 31.1, 57.5, 6.08, 7.12, 0.9, 5.4),
        "wise-mlp": (0.96, 1.39, 28.7, 49.6, 0.58, 0.88, 47.4, 91.7),
        "gcn": (0.78, 1.08, 34.3, 60.1, 0.47, 0.72, 53.9, 94.5),
        "graphmlp": (0.54, 0.86, 45.1, 72.7, 0.38, 0.45, 77.8, 96.2),
        "disgnet": (0.55, 0.88, 45.4, 71.9, 0.36, 0.44, 78.6, 97.2),
    },
    "80": {
        "plain-mlp": (0.97, 1.51, 25.7, 53.9, 7.58, 8.94, 0.5, 3.6),
        "wise-mlp": (1.25, 2.38, 20.1, 42.5, 0.73, 0.95, 41.4, 84.3),
        "gcn": (0.92, 1.42, 28.3, 55.8, 0.64, 0.82, 43.6, 88.5),
        "graphmlp": (0.70, 0.95, 39.1, 64.8, 0.45, 0.55, 55.3, 94.2),
        "disgnet": (0.69, 0.95, 39.3, 65.1, 0.44, 0.52, 57.6, 96.7),
    },
}

# method -> average time [ms], success rate [%] at gamma = 0.0001 over 1000 samples
METHODS = {"plain-mlp + CPU-NR": (54.83, 82.1), "disgnet + batched NR": (0.51, 96.5)}

GAMMAS = (0.01, 0.001, 0.0001)
# method -> iterations at the three precision levels over 1000 samples
ITERATIONS = {
    "plain-mlp + CPU-NR": (13376, 17035, 19554),
    "disgnet + batched NR": (15, 45, 75),
}

TWO_STAGE_SECONDS = {10: 0.1464, 1000: 0.3649}  # supplement, overall time of DisGNet + GPU-NR
