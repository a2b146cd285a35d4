"""Find the 40 solutions of a generic hexapod, prove them, and store them with the package.

    python tools/start_system.py            writes src/gough/modes/start_system.npz
    python tools/start_system.py --check    compares bit for bit with what is stored

Joints and a pose are drawn at random in C; the squared lengths are read
off. Solutions are carried round triangles of random complex squared lengths and base joints;
each comes back as itself or as another one (monodromy), until no loop finds a new one for ten
loops. The set is then counted again from another random pose of the same hexapod, and each
solution is refined with 70 digits and certified in ball arithmetic: 40 balls, each with one
solution, far apart. That no hexapod has more than 40 isolated solutions is a theorem (Ronga and
Vust 1995; Lazard 1993; Mourrain 1993; Wampler 1996), so the list is complete.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from gough.kernel.paths import Complex, LegEquations, track_paths
from gough.modes.frames import distances, squared_lengths
from gough.modes.starts import APART, CAREFUL, complete_by_loops, gaussian

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "tests"))
from balls import prove  # noqa: E402

STORED = ROOT / "src/gough/modes/start_system.npz"
QUIET = 10  # loops that bring nothing new before the search ends
SEED = 20


def corner(rng: np.random.Generator):
    """Random complex squared lengths and base joints."""
    return gaussian(rng, 6) * 3, gaussian(rng, 6, 3)


def draw(seed: int) -> tuple[Complex, LegEquations, np.random.Generator]:
    """A random pose (1, 7) of a random hexapod, and the leg equations that it solves."""
    rng = np.random.default_rng(seed)
    base, moving = gaussian(rng, 6, 3), gaussian(rng, 6, 3)
    pose = random_pose(rng)
    # rounded, so that no processor's way of adding shows in what is stored
    at = LegEquations(base, moving, np.round(squared_lengths(pose, base, moving)[0], 9))
    return pose, at, rng


def random_pose(rng: np.random.Generator) -> Complex:
    """A complex pose (1, 7): position, then quaternion."""
    e, t = gaussian(rng, 1, 4), gaussian(rng, 1, 3)
    return np.concatenate([t, e], axis=1)


def refine(poses: Complex, at: LegEquations) -> Complex:
    """Solutions correct to the last bit, and a proof that each is one and they are different.

    Quaternions are scaled to w = 1, so that the numbers do not depend on how they were found.
    """
    tried = [prove(at.base, at.moving, at.squares, pose[3:], pose[:3]) for pose in poses]
    proofs = [proof for proof in tried if proof is not None]
    if len(proofs) < len(tried):
        raise SystemExit("a solution cannot be certified")
    print(f"certified: {len(proofs)}; errors up to {max(p.error for p in proofs):.0e}, "
          f"radii of uniqueness from {min(p.radius for p in proofs):.0e}")  # fmt: skip
    exact = [[*map(complex, p.t), 1.0, *(complex(v / p.e[0]) for v in p.e[1:])] for p in proofs]
    gaps = distances(np.array(exact), np.array(exact)) + np.eye(len(exact))
    print(f"smallest distance of two solutions: {gaps.min():.3g}")
    return np.array(exact)


def main() -> int:
    """Find the solutions, prove them, write or compare them."""
    parser = argparse.ArgumentParser(description="Find, prove and store the 40 generic poses.")
    parser.add_argument("--check", action="store_true", help="compare with the stored file")
    check = parser.parse_args().check
    first, at, rng = draw(SEED)
    solutions, history = complete_by_loops(first, at, corner, rng, QUIET)
    print("solutions after each loop:", *history)
    # the same hexapod from another pose, other loops: its solutions at `at` must be the same
    other = random_pose(rng)
    there = LegEquations(at.base, at.moving, squared_lengths(other, at.base, at.moving)[0])
    loops = np.random.default_rng(SEED + 1)
    again, history = complete_by_loops(other, there, corner, loops, QUIET)
    print("from another pose:        ", *history)
    carried = track_paths(again, there, at.squares[None], at.base[None], share=CAREFUL).finite()
    gaps = distances(solutions, carried).min(axis=1)
    print(f"largest gap between the two sets: {gaps.max():.1e}")
    exact = refine(solutions, at)
    error = np.abs(squared_lengths(exact, at.base, at.moving) - at.squares).max()
    print(f"{len(exact)} solutions, largest error of l^2: {error:.1e}")
    if len(exact) != 40 or len(carried) != 40 or gaps.max() > APART:
        print("expected 40")
        return 1
    t, e = exact[:, :3], exact[:, 3:]
    order = np.lexsort((np.imag(t[:, 0]), np.real(t[:, 0])))
    out = {"base": at.base, "moving": at.moving, "squares": at.squares}
    out |= {"e": e[order], "t": t[order]}
    if check:
        with np.load(STORED) as stored:
            same = all(np.array_equal(stored[k], v) for k, v in out.items())
        print("same bits as stored" if same else "differs from what is stored")
        return 0 if same else 1
    np.savez(STORED, allow_pickle=False, **out)
    print(f"written: {STORED.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
