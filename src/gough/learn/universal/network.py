"""The universal network: a correction for each leg of the closed-form guess, for any hexapod.

Its input are numbers that no choice of frame, unit, leg order or mirror image changes: scalars of
each pair of legs at home, and per leg the terms of the inverse Taylor series. Its output is one
number per leg, a change of strut length, which the inverse Jacobian at home turns into a pose.
An encoder reads the machine once; from it come, for each layer, a 6 x 6 matrix per channel that
mixes the legs and an offset for each leg. So a row of readings costs a few small products only.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn
from torch.nn.functional import silu

PAIR_FEATURES, LEG_FEATURES = 13, 7
TINY = 1e-12  # keeps ratios finite at home, where all terms vanish


class Universal(nn.Module):
    """Corrected strut length changes for any machine.

    Activations are (C, M, 6, N): channels, machines, legs, rows.

    Args:
        width: channels of a row.
        layers: of mixing.
        code: channels of the encoder.
        rounds: of messages in the encoder.
    """

    def __init__(self, width: int = 48, layers: int = 3, code: int = 64, rounds: int = 2) -> None:
        super().__init__()
        self.encoder = Encoder(code, rounds)
        self.first = nn.Linear(LEG_FEATURES, width, bias=False)
        self.matrices = nn.ModuleList(nn.Linear(code, width) for _ in range(layers))
        self.offsets = nn.ModuleList(nn.Linear(4 * code, width) for _ in range(layers + 1))
        self.inner = nn.ModuleList(nn.Linear(2 * width, width, bias=False) for _ in range(layers))
        self.outer = nn.ModuleList(nn.Linear(width, width, bias=False) for _ in range(layers))
        self.last = nn.Linear(width, 1, bias=False)
        with torch.no_grad():
            self.last.weight.mul_(0.1)

    def forward(self, base: Tensor, joints: Tensor, inverse: Tensor, terms: Tensor) -> Tensor:
        """Strut length changes (M, 6, N) whose linear guess is the network's pose.

        Args:
            base, joints, inverse: machines at home, as in `gough.seeds.taylor.HomeStruts`.
            terms: (3, M, 6, N) of the series.
        """
        features, guess, scale = leg_features(terms)
        pairs = pair_features(base, joints, inverse)
        return guess + scale * self.correct(pairs.float(), features.float()).to(guess.dtype)

    def correct(self, pairs: Tensor, features: Tensor) -> Tensor:
        """Corrections (M, 6, N) from (P, M, 6, 6) and (L, M, 6, N)."""
        codes, legs = self.encoder(pairs)
        return channels(self.last, self.hidden(codes, legs, features))[0]

    def hidden(self, codes: Tensor, legs: Tensor, features: Tensor) -> Tensor:
        """Activations (C, M, 6, N) after the layers, for a machine as the encoder gives it."""
        offsets = [layer(legs).permute(2, 0, 1)[..., None] for layer in self.offsets]
        h = channels(self.first, features) + offsets[0]
        layers = zip(self.matrices, self.inner, self.outer, offsets[1:], strict=True)
        for matrix, inner, outer, offset in layers:
            mixed = matrix(codes).permute(3, 0, 1, 2) / 6**0.5 @ h  # (C, M, 6, 6) @ (C, M, 6, N)
            h = h + channels(outer, silu(channels(inner, torch.cat([h, mixed])) + offset))
        return h

    def parameter_count(self) -> int:
        """Number of trainable parameters."""
        return sum(p.numel() for p in self.parameters())


class Encoder(nn.Module):
    """Features of pairs of legs to a code for each pair and each leg."""

    def __init__(self, width: int, rounds: int) -> None:
        super().__init__()
        self.first = nn.Linear(PAIR_FEATURES, width)
        self.own = nn.ModuleList(nn.Linear(width, width) for _ in range(rounds))
        self.legs = nn.ModuleList(
            nn.Linear(4 * width, 3 * width, bias=False) for _ in range(rounds)
        )

    def forward(self, pairs: Tensor) -> tuple[Tensor, Tensor]:
        """(P, M, 6, 6) to pairs (M, 6, 6, E) and legs (M, 6, 4 E)."""
        e = silu(self.first(pairs.permute(1, 2, 3, 0)))
        for own, legs in zip(self.own, self.legs, strict=True):
            i, j, all_legs = legs(pooled(e)).chunk(3, dim=-1)
            mixed = own(e) + i[:, :, None] + j[:, None] + all_legs.mean(1)[:, None, None]
            e = e + silu(mixed)
        return e, pooled(e)


def pooled(e: Tensor) -> Tensor:
    """Legs (M, 6, 4 E) of pairs (M, 6, 6, E): the leg itself, its row, its column, all pairs."""
    itself = torch.diagonal(e, dim1=1, dim2=2).mT
    rows, columns = e.mean(2), e.mean(1)
    return torch.cat([itself, rows, columns, e.mean((1, 2))[:, None].expand_as(rows)], dim=-1)


def channels(layer: nn.Module, h: Tensor) -> Tensor:
    """A map of channels, (C, M, 6, N) to (C', M, 6, N)."""
    return (layer.get_parameter("weight") @ h.flatten(1)).unflatten(1, h.shape[1:])


def pair_features(base: Tensor, joints: Tensor, inverse: Tensor) -> Tensor:
    """Features of each pair of legs at home, (P, M, 6, 6).

    The distances between all joints determine the machine up to its frames and its mirror image.
    The rest makes plain what follows from them: angles between legs, and by column j of the
    inverse Jacobian, the twist that changes leg j alone, how far that moves and bends leg i.
    """
    n, length = directions(joints - base)
    across = distances(base, joints)
    parts = [distances(base, base), distances(joints, joints), across, across.mT]
    parts += [length[:, :, None].expand_as(across), length[:, None].expand_as(across)]
    moments = torch.linalg.cross(joints, n)
    parts += [n @ n.mT, 4 * moments @ moments.mT]
    moves, turns = inverse.mT[..., :3], inverse.mT[..., 3:]  # (M, 6, 3), by leg j
    parts += [torch.asinh((moves @ moves.mT).float()), torch.asinh((turns @ turns.mT).float() / 4)]
    spun = torch.linalg.cross(turns[:, None], joints[:, :, None])  # (M, 6, 6, 3)
    speed, n = moves[:, None] + spun, n[:, :, None]
    across_leg = speed.square().sum(-1) - (speed * n).sum(-1).square()
    bend = across_leg / length[..., None]
    bend = bend + (torch.linalg.cross(turns[:, None], spun) * n).sum(-1)
    bend = torch.asinh(bend.float() / 8)
    parts += [bend, bend.mT, torch.eye(6, device=base.device).expand_as(across)]
    return torch.stack([part.float() for part in parts])


def leg_features(terms: Any) -> tuple[Tensor, Tensor, Tensor]:
    """Features (L, M, 6, N), the closed-form guess and the size of its error, from series terms.

    Where the series diverges its terms are large, and the guess falls back to the first of them.
    """
    first, second, third = terms[0], terms[1], terms[2]  # (M, 6, N)
    size = rms(first) + TINY
    ratio, ratio3 = rms(second) / size, rms(third) / size
    kept = 1 / (1 + ratio**4), 1 / (1 + ratio**4 + ratio3**2)
    grows = (ratio**3 + ratio3).clamp(max=10.0)
    one = torch.ones_like(first)
    parts = [
        8 * first, torch.asinh((16 * second).float()), torch.asinh((32 * third).float()),
        first / size, second / (size * ratio + TINY),
        one * torch.log(ratio + 1e-6) / 2, one * torch.log(ratio3 + 1e-6) / 2,
    ]  # fmt: skip
    features = torch.stack([part.float() for part in parts])
    return features, first + second * kept[0] + third * kept[1], size * grows / (1 + grows)


def rms(values: Tensor) -> Tensor:
    """Root mean square over the legs of (M, 6, N), (M, 1, N)."""
    return values.square().mean(1, keepdim=True).sqrt()


def directions(vectors: Tensor) -> tuple[Tensor, Tensor]:
    """Unit vectors (..., 3) and lengths (...)."""
    length = vectors.square().sum(-1).sqrt()
    return vectors / length[..., None], length


def distances(a: Tensor, b: Tensor) -> Tensor:
    """Between all points of (M, 6, 3) and (M, 6, 3), (M, 6, 6)."""
    return (a[:, :, None] - b[:, None]).square().sum(-1).sqrt()
