"""Combinations of the parameters that an instrument can find, and the rest in words."""

from __future__ import annotations

import numpy as np

from gough.calibration.arrays import Array
from gough.calibration.estimate import Problem, State
from gough.calibration.parameters import Parameters
from gough.calibration.prediction import Workspace
from gough.calibration.sensors import Sensor

ZERO = 1e-10  # of the largest singular value: below it a combination is not seen at all

LEARNED = 1e-3  # of the drawing's own information: below it nothing was learned

WORDS = {
    "pose": "",
    "targets": "",
    "distances": "",
    "position": (
        "One target does not show how the tool is rotated about it: 3 directions, which move the "
        "platform joints about the target, stay as drawn."
    ),
    "one distance": (
        "One distance does not show rotations about its station and about its target: 6 "
        "directions, which move all base joints or all platform joints, stay as drawn."
    ),
    "orientation": (
        "Orientations show no position: 6 directions (translations of all base joints and of all "
        "platform joints), with gains the size of the machine too, stay as drawn."
    ),
    "inclinometer": (
        "An inclinometer shows neither position nor heading: 7 directions (translations of all "
        "base joints and of all platform joints, the rotation of the base about the vertical), "
        "with gains the size of the machine too, stay as drawn."
    ),
}


def rank(parameters: Parameters, sensor: Sensor, place: object) -> int:
    """Number of the 6 K combinations that the instrument fixes if its placement is known.

    From many poses spread over the workspace: what more poses of the same kind could show.
    """
    workspace = Workspace.of(Problem(parameters, sensor, np.zeros((0, 6)), 1.0))
    state = State(parameters.drawn, place, workspace.near)
    G = workspace.derivatives(state)[0][..., : parameters.drawn.size]
    units = np.ones(G.shape[1])
    if sensor.kind == "pose":
        units[3:] = parameters.drawing.size
    return numerical_rank((G * units[:, None]).reshape(-1, G.shape[-1]))


def numerical_rank(A: Array) -> int:
    """Rank of a matrix whose columns have different units."""
    scale = np.linalg.norm(A, axis=0)
    scale[scale == 0] = 1
    triangle = np.linalg.qr(A / scale, mode="r")  # faster than the values of the whole matrix
    values = np.linalg.svd(triangle, compute_uv=False)
    return int(np.sum(values > ZERO * values[0])) if values[0] > 0 else 0


def in_words(sensor: Sensor) -> str:
    """Sentence on what an instrument cannot see by its nature; empty if there is nothing."""
    kind = "one distance" if sensor.kind == "distances" and sensor.numbers == 1 else sensor.kind
    return WORDS[kind]


def needed_poses(parameters: Parameters, rank: int, numbers: int) -> int:
    """Fewest poses with which the data fix all that the instrument can show."""
    return -(-rank // numbers) + 1


def weakest(
    parameters: Parameters, information: Array, count: int = 3
) -> tuple[int, list[tuple[float, str]]]:
    """The combinations that the data say least about.

    Args:
        information: (P, P) of the data alone.
        count: how many of them.

    Returns:
        How many combinations nothing was learned of, such as moving all base joints with a frame
        that is not known. For each of the next: its standard deviation after measuring as a share
        of that before, and the parameters it is made of, in words.
    """
    size = parameters.drawn.size
    tolerance = parameters.tolerance.ravel()
    matrix = information[:size, :size]
    if len(information) > size:  # the placement is not known: its share is taken out
        cross, own = information[:size, size:], information[size:, size:]
        matrix = matrix - cross @ np.linalg.pinv(own, hermitian=True) @ cross.T
    scaled = matrix * np.outer(tolerance, tolerance)
    values, vectors = np.linalg.eigh((scaled + scaled.T) / 2)
    unseen = int(np.sum(values < LEARNED))
    shares = 1 / np.sqrt(1 + values[unseen : unseen + count])
    words = (_words(parameters, v) for v in vectors.T[unseen : unseen + count])
    return unseen, list(zip(map(float, shares), words, strict=True))


def _words(parameters: Parameters, vector: Array) -> str:
    """The largest parts of a combination."""
    order = np.argsort(-np.abs(vector))[:4]
    names = [
        f"{'-' if vector[i] * vector[order[0]] < 0 else '+'} leg {i // parameters.count + 1} "
        f"{parameters.names[i % parameters.count]}"
        for i in order
    ]
    share = np.sum(vector[order] ** 2)
    more = f", and others ({100 * (1 - share):.0f} %)" if share < 0.95 else ""
    return " ".join(names).removeprefix("+ ") + more
