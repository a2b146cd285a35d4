"""Quantities of a pose that an instrument measures."""

from __future__ import annotations

from typing import Literal, get_args

Kind = Literal["pose", "position", "orientation", "targets", "distances", "inclinometer"]
KINDS: tuple[Kind, ...] = get_args(Kind)
