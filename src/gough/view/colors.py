"""Colours that all kinds of colour vision tell apart (Okabe and Ito), on a light ground."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.platform import Platform

BLUE, GREEN, YELLOW, VERMILION = "#0072B2", "#009E73", "#F0E442", "#D55E00"
ORANGE, GREY = "#E69F00", "#7A8590"
GROUND, GROUND_FIFTH = "#DDE1E5", "#B9C0C7"
BASE, PLATE = "#A7B0B8", "#5B6B7B"
RAMP = (BLUE, GREEN, YELLOW)  # lowest, middle and highest reading of a stroke
OUT = "#D1001C"  # out of stroke: red, and darker than any colour of the ramp
SAME, OTHER = BLUE, VERMILION  # sign of det J as at home, or not; as `gough modes --plot`


def rgb(color: str) -> tuple[int, int, int]:
    """Red, green and blue, 0 to 255, of "#rrggbb"."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def stroke_share(platform: Platform, legs: Array) -> Array:
    """Where readings (..., 6) stand in their stroke: 0 lowest, 1 highest; NaN without a stroke."""
    if platform.stroke is None:
        return np.full(np.shape(legs), np.nan)
    low, high = platform.stroke.T
    return (legs - low) / (high - low)


def out_of_stroke(platform: Platform, legs: Array) -> NDArray[np.bool_]:
    """Which readings (..., 6) are beyond their limits, which themselves are allowed."""
    share = stroke_share(platform, legs)
    return (share < -1e-9) | (share > 1 + 1e-9)


def leg_colors(platform: Platform, legs: Array) -> NDArray[np.uint8]:
    """Colours (6, 3) of legs by where they stand in their stroke; grey where none is stated."""
    if platform.stroke is None:
        return np.tile(np.array(rgb(GREY), np.uint8), (6, 1))
    share = np.clip(stroke_share(platform, legs), 0, 1)
    stops = np.array([rgb(color) for color in RAMP], float)
    where = np.linspace(0, 1, len(RAMP))
    colors = np.stack([np.interp(share, where, channel) for channel in stops.T], axis=-1)
    colors[out_of_stroke(platform, legs)] = rgb(OUT)
    return np.round(colors).astype(np.uint8)
