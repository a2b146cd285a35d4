"""One network for every hexapod: a first guess without fitting, training or a workspace.

The guess has three parts: the inverse Taylor series about home in closed form, a network that
corrects the strut length changes it starts from, and one damped Newton step in double precision.
The network sees numbers that no choice of frame, unit, leg order or mirror image changes, and its
answer is one number per leg, which the inverse Jacobian at home turns into a pose: so the guess
turns, scales, mirrors and is renumbered with the machine by construction. `gough.learn.universal`
trains it on random machines; it belongs to no platform.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from gough.checks import Array, as_batch
from gough.errors import GoughError
from gough.platform import Platform
from gough.pose import Pose
from gough.seeds.damped import FAR, Polished, polish, strut_errors
from gough.seeds.network import NETWORK, read, read_facts, run, session
from gough.seeds.taylor import HomeStruts, cross, gibbs_quaternion, series

KIND, FILE = "universal", "universal.onnx"
ORDER = 3  # terms of the series that the network sees
CHUNK = 1024  # rows evaluated at a time
MACHINES = 256  # machines evaluated at a time
FLOOR = 1e-14  # smallest predicted error, as a share of the size: rounding


@dataclass(frozen=True, eq=False)
class Guess:
    """Poses and how far from the truth they may be.

    Attributes:
        pose: batch (N,).
        position_error: predicted error of the position, (N,) [platform unit].
        rotation_error: predicted error of the rotation, (N,) [rad].
    """

    pose: Pose
    position_error: Array
    rotation_error: Array


class UniversalSeed:
    """The network that comes with gough, or one fine-tuned from it, for any platform.

    Args:
        path: a run's folder or its .onnx file; none: the one that comes with gough.
        threads: CPU threads for evaluation; 0: as many as there are cores.
        polished: take the damped Newton steps; without them the guess is the network's own answer.

    Raises:
        GoughError: no such file, a damaged one, or one fine-tuned for another platform.
    """

    name = KIND

    def __init__(self, platform: Platform, path: str | Path | None = None, *, threads: int = 0,
                 polished: bool = True
                 ) -> None:  # fmt: skip
        self.platform, self._polished = platform, polished
        self._where = FILE if path is None else str(path)
        self._session, self.facts = _open(platform, path, threads)

    def guess(self, legs: Array) -> Pose:
        """Poses (N,) for readings (N, 6), finite for finite readings."""
        return self.guess_with_error(legs).pose

    def guess_with_error(self, legs: Array) -> Guess:
        """Poses (N,) for readings (N, 6), with their predicted errors.

        The prediction is the next Newton step, which is not taken: its size tells the error where
        Newton's method converges. 3 times as much is exceeded by less than 1 % of the poses
        about home; see docs/universal.md for boxes and machines.
        """
        legs = as_batch("legs", legs, (6,)).reshape(-1, 6)
        parts = [self._part(legs[i : i + CHUNK]) for i in range(0, len(legs), CHUNK)]
        position = np.concatenate([np.zeros((0, 3)), *(p.pose.position for p in parts)])
        wxyz = np.concatenate([np.zeros((0, 4)), *(p.pose.wxyz for p in parts)])
        errors = [np.concatenate([np.zeros(0), *(getattr(p, name) for p in parts)])
                  for name in ("position_error", "rotation_error")]  # fmt: skip
        return Guess(Pose.trusted(position, wxyz), *errors)

    def _part(self, legs: Array) -> Guess:
        with np.errstate(all="ignore"):  # readings far from any pose overflow, and end at home
            home = HomeStruts.of(self.platform, legs)
            terms = np.stack(series(home.base, home.joints, home.inverse, home.change, ORDER))
            network = home.twist(self._corrected(home, terms))
            if self._polished:
                found = polish(home, network, second_order(home, terms))
            else:
                wxyz = gibbs_quaternion(network[3:])
                found = Polished(network[:3], wxyz, np.zeros_like(network))
            arm = home.arm(self.platform, found.wxyz)
            away = found.step[:3] + cross(found.step[3:], arm)
            errors = [np.sqrt(np.sum(e * e, axis=0)).ravel() for e in (away, found.step[3:])]
        errors = [FLOOR + np.where(np.isfinite(e), e, np.inf) for e in errors]
        pose = home.pose(self.platform, found.t, found.wxyz)
        return Guess(pose, self.platform.size * errors[0], errors[1])

    def _corrected(self, struts: HomeStruts, terms: Array) -> Array:
        """Strut length changes whose linear guess is the network's pose, (M, 6, N).

        Each reading of a rotary platform makes another machine. The network reads the one at
        home for all of them, which costs a tenth, and each its own where that guess is far off.
        """
        if self.platform.rotary is None:
            return self._run(struts, terms)
        home = HomeStruts.of(self.platform, self.platform.home_legs[None])
        shared = self._run(home, terms[..., 0].swapaxes(1, 2)[:, None])  # (1, 6, readings)
        changes = shared[0].T[..., None]
        miss = strut_errors(struts, struts.twist(changes))
        far = ~(np.max(np.abs(miss), axis=1) < FAR)  # (readings, 1), also where it is NaN
        if far.any():
            own = self._run(struts.pick(far), terms[:, far[:, 0]])
            changes[far[:, 0]] = own
        return changes

    def _run(self, struts: HomeStruts, terms: Array) -> Array:
        """The network's answer (M, 6, N)."""
        parts = []
        for i in range(0, len(struts.base), MACHINES):
            some = slice(i, i + MACHINES)
            given = {
                "base": struts.base[some], "joints": struts.joints[some],
                "inverse": struts.inverse[some], "terms": np.ascontiguousarray(terms[:, some]),
            }  # fmt: skip
            parts.append(run(self._session, self._where, given)[0])
        return np.concatenate(parts)


def second_order(home: HomeStruts, terms: Array) -> Array:
    """Twists (6, M, N) of the second-order series, home where its second term is the larger."""
    first, second = (home.twist(term) for term in terms[:2])
    size = lambda x: np.sum(x * x, axis=0)  # noqa: E731
    return np.where(size(second) < size(first), first + second, 0.0)


def _open(platform: Platform, path: str | Path | None, threads: int) -> tuple[Any, dict]:
    """The network's session and facts."""
    if path is None:
        return _shipped(threads)
    file = Path(path)
    content = read(file / NETWORK if file.is_dir() else file)
    facts = read_facts(content, str(path))
    if facts["kind"] != KIND:
        raise GoughError(f"{path}: a {facts['kind']} network, not a universal one")
    if facts["platform"] not in (None, platform.digest):
        raise GoughError(
            f"{path}: fine-tuned for platform {facts['platform_name']!r}, not for "
            f"{platform.name!r} as it is now (joints, home, legs or workspace differ); the seed "
            "'universal' is for any platform"
        )
    return session(content, str(path), threads), facts


@lru_cache(maxsize=4)
def _shipped(threads: int) -> tuple[Any, dict]:
    content = resources.files("gough").joinpath("weights", FILE).read_bytes()
    return session(content, FILE, threads), read_facts(content, FILE)
