"""Designs of a network for every hexapod, each trained for the same processor time.

python benchmarks/universal_designs.py                      # all of them, 200 s each
python benchmarks/universal_designs.py 60 shipped prototype # seconds and names

Every design gets the same random machines, loss, optimiser and rate
(`gough.learn.universal.train`) and answers as the shipped network does: six strut length changes
that the inverse Jacobian at home turns into the pose. Errors are mean translation errors as shares
of the machine's size in %, over poses with home's sign of det J: 500 random machines over +-8 % and
+-30 deg, and machines of the catalog in the boxes of `benchmarks/universal.py`. "After steps" is
after the damped Newton steps of the seed. Times are those of PyTorch on one thread, the series
included.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import roma
import torch
from torch import Tensor, nn
from torch.nn.functional import normalize, silu
from universal import NARROW

import gough
from gough.learn.universal import network
from gough.learn.universal.finetune import PlatformPoses
from gough.learn.universal.machines import Draw, Machines, Poses, jacobian
from gough.learn.universal.network import Universal, channels, leg_features, pair_features, rms
from gough.learn.universal.train import (
    DEFAULT,
    SHIPPED,
    RandomMachines,
    Trainer,
    cayley,
    mean_by_machine,
    pose_errors,
)
from gough.seeds.damped import polish
from gough.seeds.taylor import HomeStruts, series

ZIGZAG = ("reference", "nasa_msfc", "matlab_stewart", "linuxcnc_genhex")
OTHERS = ("dietmaier", "rubin_camera")


class About(Universal):
    """The shipped network, correcting a series of another order or a damped Newton step from it.

    For a step the network's three terms are the start, the step and the next with the same matrix.
    """

    def __init__(self, order: int, newton: bool = False, **options: int) -> None:
        super().__init__(**SHIPPED | options)
        self.order, self.newton = order, newton
        if newton:
            width = self.first.out_features
            self.first = nn.Linear(self.first.in_features + 1, width, bias=False)

    def forward(self, base: Tensor, joints: Tensor, inverse: Tensor, terms: Tensor) -> Tensor:
        features, guess, scale = self.start(base, joints, inverse, terms)
        pairs = pair_features(base, joints, inverse)
        return guess + scale * self.correct(pairs.float(), features.float()).to(guess.dtype)

    def start(self, base: Tensor, joints: Tensor, inverse: Tensor, terms: Tensor
              ) -> tuple[Tensor, Tensor, Tensor]:  # fmt: skip
        """What the network sees (L, M, 6, N), what it corrects, and by how much about."""
        used = torch.where(torch.arange(3)[:, None, None, None] < self.order, terms, 0.0)
        features, guess, scale = leg_features(used)
        size = rms(terms[0]) + network.TINY
        if self.newton:
            used = stepped(base, joints, inverse, terms[0], guess)
            features, guess, scale = leg_features(used)
            more = used[2] / (rms(used[2]) + network.TINY)
            features = torch.cat([features, more[None].float()])
        elif self.order < 3:
            ratio = 4 * size if self.order == 1 else rms(terms[1]) / size
            grows = (ratio**self.order).clamp(max=10.0)
            scale = size * grows / (1 + grows)
        return features, guess, scale


def stepped(base: Tensor, joints: Tensor, inverse: Tensor, change: Tensor, guess: Tensor) -> Tensor:
    """The guess, what a damped Newton step adds to it and what the next adds, (3, M, 6, N)."""
    home = torch.linalg.vector_norm(joints - base, dim=-1)[..., None]
    at_home = jacobian(joints - base, joints)
    x = (inverse @ guess).mT
    t, R = x[..., :3], cayley(x[..., 3:])
    gain, found, twists = None, guess, [guess]
    for _ in range(2):
        levers = joints[:, None] @ R.mT
        struts = levers + t[..., None, :] - base[:, None]
        miss = (home + change).mT - torch.linalg.vector_norm(struts, dim=-1)
        if gain is None:
            J = jacobian(struts, levers)
            damping = miss.square().mean(-1)[..., None, None] + 1e-12
            gain = torch.linalg.solve(J.mT @ J + damping * torch.eye(6, dtype=J.dtype), J.mT)
        step = (gain @ miss[..., None])[..., 0]
        t, R = t + step[..., :3], cayley(step[..., 3:]) @ R
        changes = at_home @ torch.cat([t, gibbs(R)], dim=-1).mT
        twists.append(changes - found)
        found = changes
    return torch.stack(twists)


def gibbs(R: Tensor) -> Tensor:
    """Twice the Gibbs vectors (..., 3) of rotations, the inverse of `cayley`."""
    skew = torch.stack([R[..., 2, 1], R[..., 0, 2], R[..., 1, 0]], -1)
    skew = skew - torch.stack([R[..., 1, 2], R[..., 2, 0], R[..., 0, 1]], -1)
    trace = torch.diagonal(R, dim1=-2, dim2=-1).sum(-1, keepdim=True)
    return 2 * skew / (1 + trace).clamp(min=0.1)


class Prototype(nn.Module):
    """A residual MLP in a frame from the legs, numbered by angle, about the second-order series."""

    def __init__(self, width: int = 256, layers: int = 6) -> None:
        super().__init__()
        self.first = nn.Linear(60, width)
        self.layers = nn.ModuleList(nn.Linear(width, width) for _ in range(layers))
        self.last = nn.Linear(width, 6)
        nn.init.zeros_(self.last.bias)
        with torch.no_grad():
            self.last.weight.mul_(0.01)

    def forward(self, base: Tensor, joints: Tensor, inverse: Tensor, terms: Tensor) -> Tensor:
        order, frame = numbered(base, joints)
        picked = lambda v: torch.take_along_dim(v, order[..., None], dim=1)  # noqa: E731
        b, r = picked(base) @ frame.mT, picked(joints) @ frame.mT
        turned = lambda x: (x.unflatten(-1, (2, 3)) @ frame[:, None].mT).flatten(-2)  # noqa: E731
        used = torch.cat([terms[:2], 0 * terms[:1]])
        linear, start = (inverse @ terms[0]).mT, (inverse @ leg_features(used)[1]).mT  # (M, N, 6)
        n, length = network.directions(r - b)
        known = torch.cat([r, n, length[..., None]], dim=-1).flatten(1)[:, None]
        change = picked(terms[0]).mT
        h = torch.cat([known.expand(-1, change.shape[1], -1), 8 * change,
                       4 * turned(linear), 4 * turned(start)], dim=-1)  # fmt: skip
        h = self.first(h.float())
        for layer in self.layers:
            h = h + silu(layer(h))
        away = 0.1 * self.last(h).to(start.dtype)
        x = start + (away.unflatten(-1, (2, 3)) @ frame[:, None]).flatten(-2)
        return jacobian(joints - base, joints) @ x.mT


def numbered(base: Tensor, joints: Tensor) -> tuple[Tensor, Tensor]:
    """Legs by angle, from a close pair of base joints (M, 6); a frame's axes as rows (M, 3, 3)."""
    up = normalize((joints - base).mean(1), dim=-1)
    aside = normalize(
        torch.linalg.cross(up, torch.eye(3, dtype=up.dtype)[up.abs().argmin(-1)]), dim=-1
    )
    points = 0.7 * base + 0.3 * joints
    points = points - points.mean(1, keepdim=True)
    third = torch.linalg.cross(up, aside)
    angle = torch.atan2((points * third[:, None]).sum(-1), (points * aside[:, None]).sum(-1))
    order = angle.argsort(-1)
    b = torch.take_along_dim(base, order[..., None], dim=1)
    gaps = torch.linalg.vector_norm(b - b.roll(-1, 1), dim=-1)  # from leg k to k + 1
    odd = gaps[:, 1::2].sum(-1) < gaps[:, ::2].sum(-1)
    order = torch.where(odd[:, None], order.roll(-1, 1), order)
    b, r = (torch.take_along_dim(v, order[..., None], dim=1) for v in (base, joints))
    z = normalize(normalize(r - b, dim=-1).sum(1), dim=-1)
    x = b[:, 0] + b[:, 1]
    x = normalize(x - (x * z).sum(-1, keepdim=True) * z, dim=-1)
    return order, torch.stack([x, torch.linalg.cross(z, x), z], dim=1)


class Graph(nn.Module):
    """DisGNet's 2-FWL step over the twelve joints, with the machine's geometry on their pairs.

    A node has its leg's numbers, a pair distances and what else `pair_features` says of its two
    legs. The answer is a correction for each leg to the third-order series.
    """

    def __init__(self, width: int = 16, code: int = 48) -> None:
        super().__init__()
        maps = lambda inputs: nn.Sequential(  # noqa: E731
            nn.Linear(inputs, code), nn.SiLU(), nn.Linear(code, code), nn.SiLU(),
            nn.Linear(code, width),
        )  # fmt: skip
        self.pairs = maps(network.PAIR_FEATURES + 5)
        self.nodes = nn.ModuleList([maps(network.LEG_FEATURES + 1) for _ in range(2)])
        self.factors = nn.Linear(width, 3 * width)
        self.a, self.b = nn.Linear(width, 2 * width), nn.Linear(2 * width, width)
        self.head = nn.Sequential(
            nn.Linear(6 * width, 2 * code), nn.SiLU(), nn.Linear(2 * code, code), nn.SiLU(),
            nn.Linear(code, 1),
        )  # fmt: skip

    def forward(self, base: Tensor, joints: Tensor, inverse: Tensor, terms: Tensor) -> Tensor:
        features, guess, scale = leg_features(terms)
        h = self.initial(base, joints, inverse, features.float())
        p, q, s = (v.permute(0, 1, 4, 2, 3) for v in self.factors(h).chunk(3, dim=-1))
        m = (s * (p @ q)).permute(0, 1, 3, 4, 2)  # (M, N, 12, 12, H)
        m = nn.functional.rms_norm(m, m.shape[-1:])
        h = h + m + self.b(silu(self.a(m)))
        legs = torch.cat([h.mean(2), h.mean(3)], dim=-1).unflatten(2, (2, 6))
        own = torch.diagonal(h[:, :, :6, 6:], dim1=2, dim2=3).mT
        whole = h.mean((2, 3))[:, :, None].expand_as(own)
        z = torch.cat([legs[:, :, 0], legs[:, :, 1], own, whole], dim=-1)  # (M, N, 6, 6 H)
        return guess + scale * self.head(z)[..., 0].mT.to(guess.dtype)

    def initial(self, base: Tensor, joints: Tensor, inverse: Tensor, features: Tensor) -> Tensor:
        """Pairs (M, N, 12, 12, H) before the step: the paper's equation 7."""
        points = torch.cat([base, joints], dim=1)
        apart = network.distances(points, points).float()[..., None]
        side = torch.tensor([0.0, 1.0]).repeat_interleave(6)
        across = side[:, None].expand(12, 12)
        same = torch.eye(6).repeat(2, 2)
        kinds = torch.stack([across, across.T, (across == across.T).float(), same], -1)
        geometry = pair_features(base, joints, inverse).permute(1, 2, 3, 0).repeat(1, 2, 2, 1)
        known = torch.cat([geometry, apart, kinds.expand(len(base), -1, -1, -1)], dim=-1)
        legs = features.permute(1, 3, 2, 0).repeat(1, 1, 2, 1)  # (M, N, 12, L)
        nodes = torch.cat([legs, side[:, None].expand(*legs.shape[:-1], 1)], dim=-1)
        u, v = (f(nodes) for f in self.nodes)
        return self.pairs(known)[:, None] * u[:, :, :, None] * v[:, :, None]


class Distances(Universal):
    """The 30 distances that no leg measures, about the third-order series, and the pose from them.

    Each platform joint moves by least squares to its six distances; the nearest rotation (by SVD,
    never a reflection) and the mean of the joints are the pose.
    """

    def __init__(self, channels_of_pairs: int = 16) -> None:
        super().__init__(**SHIPPED)
        width, code = self.first.out_features, SHIPPED["code"]
        self.ends = nn.ModuleList(nn.Linear(width, channels_of_pairs, bias=False) for _ in range(2))
        self.codes = nn.Linear(code, channels_of_pairs)
        self.last = nn.Linear(channels_of_pairs, 1, bias=False)
        with torch.no_grad():
            self.last.weight.mul_(0.1)

    def forward(self, base: Tensor, joints: Tensor, inverse: Tensor, terms: Tensor) -> Tensor:
        features, guess, scale = leg_features(terms)
        codes, legs = self.encoder(pair_features(base, joints, inverse).float())
        h = self.hidden(codes, legs, features.float())
        i, j = (channels(end, h) for end in self.ends)
        mixed = i[:, :, :, None] + j[:, :, None] + self.codes(codes).permute(3, 0, 1, 2)[..., None]
        away = channels(self.last, silu(mixed).flatten(2, 3))[0].unflatten(
            1, (6, 6)
        )  # (M, 6, 6, N)
        away = scale[:, :, None] * away.to(guess.dtype)
        x = (inverse @ guess).mT
        points = joints[:, None] @ cayley(x[..., 3:]).mT + x[..., None, :3]  # (M, N, 6, 3)
        n, length = network.directions(points[:, :, None] - base[:, None, :, None])  # (M, N, i, j)
        home = torch.linalg.vector_norm(joints - base, dim=-1)[..., None]
        measured = (home + terms[0]).mT - torch.diagonal(length, dim1=2, dim2=3)
        miss = torch.where(torch.eye(6) > 0, torch.diag_embed(measured), away.permute(0, 3, 1, 2))
        n = n.transpose(2, 3)  # (M, N, j, i, 3)
        matrix = n.mT @ n + 1e-3 * torch.eye(3, dtype=n.dtype)
        moved = torch.linalg.solve(matrix, n.mT @ miss.mT[..., None])[..., 0]
        points = points + moved
        t = points.mean(2)
        spread = (points - t[:, :, None]).mT @ joints[:, None]
        R = roma.special_procrustes(spread / torch.linalg.matrix_norm(spread)[..., None, None])
        assert isinstance(R, Tensor)
        return jacobian(joints - base, joints) @ torch.cat([t, gibbs(R)], dim=-1).mT


class Series(nn.Module):
    """A series without a network, or a damped Newton step from it."""

    def __init__(self, order: int, newton: bool = False) -> None:
        super().__init__()
        self.order, self.newton = order, newton

    def forward(self, base: Tensor, joints: Tensor, inverse: Tensor, terms: Tensor) -> Tensor:
        found = terms[: self.order].sum(0)
        return stepped(base, joints, inverse, terms[0], found)[:2].sum(0) if self.newton else found


DESIGNS: dict[str, tuple[str, Callable[[], nn.Module]]] = {
    "taylor-1": ("linear guess, no network", lambda: Series(1)),
    "taylor-2": ("second-order series, no network", lambda: Series(2)),
    "taylor-3": ("third-order series, no network", lambda: Series(3)),
    "step-1": ("a Newton step from taylor-1, no network", lambda: Series(1, True)),
    "step-2": ("a Newton step from taylor-2, no network", lambda: Series(2, True)),
    "step-3": ("a Newton step from taylor-3, no network", lambda: Series(3, True)),
    "shipped": ("legs with scalars of their pairs, about taylor-3 (shipped)", lambda: About(3)),
    "about-1": ("the same about taylor-1", lambda: About(1)),
    "about-2": ("the same about taylor-2", lambda: About(2)),
    "newton-1": ("the same about a Newton step from taylor-1", lambda: About(1, True)),
    "newton-2": ("the same about a Newton step from taylor-2", lambda: About(2, True)),
    "newton-3": ("the same about a Newton step from taylor-3", lambda: About(3, True)),
    "width-16": ("shipped, width 16, code 24", lambda: About(3, width=16, code=24)),
    "width-64": ("shipped, width 64, code 64", lambda: About(3, width=64, code=64)),
    "prototype": ("residual MLP in a frame from the legs, about taylor-2", Prototype),
    "graph": ("2-FWL graph over the joints, about taylor-3", Graph),
    "distances": ("30 distances completed about taylor-3, pose by SVD", Distances),
}  # fmt: skip


def trained(model: nn.Module, seconds: float) -> int:
    """Train for so much processor time, or not at all without parameters; the steps taken."""
    if not list(model.parameters()):
        return 0
    run = replace(DEFAULT.run, budget=f"{seconds:g}s")
    config = replace(DEFAULT, run=run)
    trainer = Trainer(config, Path(), RandomMachines(config), model)  # type: ignore[arg-type]
    trainer.clock.tick()
    while (progress := trainer.clock.progress(trainer.step)) < 1:
        trainer.learn(progress)
        trainer.clock.tick()
    model.eval()
    return trainer.step


def held_out() -> dict[str, tuple[Machines, Poses]]:
    """Poses of 500 random machines, and of each machine of the catalog."""
    draw = Draw(10**9)
    machines = draw.machines(500, 0.0)
    groups = {"random": (machines, draw.poses(machines, 60, (0.08, 30.0)))}
    for name in (*ZIGZAG, *OTHERS):
        platform = gough.Platform.load(name)
        platform = platform.with_workspace(NARROW[name][0] * platform.size, NARROW[name][1])
        groups[name] = PlatformPoses(platform, 0, 4000).batch(-77)
    return groups


@torch.no_grad()
def errors(model: nn.Module, machines: Machines, poses: Poses) -> np.ndarray:
    """Mean errors of the machines in %, (M,)."""
    error, _ = pose_errors(model, machines, poses)  # type: ignore[arg-type]
    return 100 * mean_by_machine(error.nan_to_num(1e9), poses.regular).numpy()


@torch.no_grad()
def after_steps(model: nn.Module, machines: Machines, poses: Poses) -> np.ndarray:
    """The same after the damped Newton steps."""
    found = np.empty(poses.translation.shape)
    changes = answers(model, machines, poses.change)
    with np.errstate(all="ignore"):
        for i in range(len(machines)):
            one = machines[i : i + 1]
            side = float(torch.linalg.det(one.inverse).sign())
            lengths = torch.linalg.vector_norm(one.joints - one.base, dim=-1)[..., None]
            change = poses.change[i : i + 1]
            parts = (one.base, one.joints, one.inverse, change, lengths + change)
            base, joints, inverse, change, lengths = (v.numpy() for v in parts)
            home = HomeStruts(base, joints, inverse, change, lengths, side)
            found[i] = polish(home, home.twist(changes[i : i + 1].numpy())).t[:, 0].T
    error = torch.linalg.vector_norm(torch.tensor(found) - poses.translation, dim=-1)
    return 100 * mean_by_machine(error, poses.regular).numpy()


def answers(model: nn.Module, machines: Machines, change: Tensor) -> Tensor:
    """Strut length changes (M, 6, N) of the guesses."""
    terms = series(machines.base, machines.joints, machines.inverse, change, 3)
    return model(machines.base, machines.joints, machines.inverse, torch.stack(terms))


@torch.no_grad()
def milliseconds(model: nn.Module, machines: Machines, poses: Poses) -> float:
    """Least time of 30 calls for 1,000 rows of one machine, one thread, series included."""
    change, times = poses.change[..., :1000].contiguous(), []
    for _ in range(30):
        began = time.perf_counter()
        answers(model, machines, change)
        times.append(time.perf_counter() - began)
    return 1e3 * min(times)


def main(seconds: float, names: list[str]) -> None:
    """Print the table, a row as soon as it is known."""
    torch.set_num_threads(1)
    heads = ("design", "numbers", "steps", "1,000 guesses, ms", "random, median", "90 % below",
             "zigzag, mean", *OTHERS, "random after steps, median", "90 % below")  # fmt: skip
    print(f"| {' | '.join(heads)} |\n|---|{'---:|' * (len(heads) - 1)}", flush=True)
    groups = held_out()
    for name in names:
        text, make = DESIGNS[name]
        torch.manual_seed(0)
        model = make()
        steps = trained(model, seconds)
        random = errors(model, *groups["random"])
        polished = after_steps(model, *groups["random"])
        catalog = {n: errors(model, *groups[n])[0] for n in (*ZIGZAG, *OTHERS)}
        zigzag = float(np.mean([catalog[n] for n in ZIGZAG]))
        found = [np.median(random), np.quantile(random, 0.9), zigzag, *(catalog[n] for n in OTHERS),
                 np.median(polished), np.quantile(polished, 0.9)]  # fmt: skip
        count = sum(p.numel() for p in model.parameters())
        ms = milliseconds(model, *groups["reference"])
        cells = [text, f"{count:,}", f"{steps:,}", f"{ms:.1f}", *(f"{v:.2g}" for v in found)]
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    given = sys.argv[1:]
    budget = float(given.pop(0)) if given and given[0].replace(".", "").isdigit() else 200.0
    main(budget, given or list(DESIGNS))
