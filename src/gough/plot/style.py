"""One look for all pictures, and how a figure becomes a file.

Colours are those of Okabe and Ito (2008), distinct for all kinds of colour vision. A line style, a
marker or a number repeats what each colour means, so that grey print loses nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.figure import Figure

from gough.checks import Array
from gough.errors import GoughError
from gough.platform import Platform
from gough.pose import Pose, pose_values
from gough.text import decimals
from gough.whole_file import check_target, replacing

BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY = (
    "#0072B2", "#D55E00", "#009E73", "#AA4499", "#E69F00", "#56B4E9",
)  # fmt: skip
INK, GREY, FAINT = "#222222", "#707070", "#C8C8C8"
MINUS = "\N{MINUS SIGN}"

# six curves on one picture: colour and line style
CURVES: tuple[tuple[str, Any], ...] = (
    (BLUE, "-"),
    (VERMILION, (0, (6, 1.5))),
    (GREEN, (0, (6, 1.5, 1.2, 1.5))),
    (PURPLE, (0, (1.2, 1.2))),
    (INK, (0, (3, 1))),
    (ORANGE, (0, (6, 1.5, 1.2, 1.5, 1.2, 1.5))),
)

ENDINGS = (".svg", ".png", ".pdf")
DPI = 160

_RC: dict[Any, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib, so pictures are the same everywhere
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "figure.titlesize": 11,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    # the page around a picture may be dark
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.hashsalt": "gough",  # the same picture gives the same bytes
    "svg.fonttype": "path",
}

P = ParamSpec("P")
T = TypeVar("T")


@contextmanager
def house_style() -> Iterator[None]:
    """Context in which figures and axes have this look, whatever a matplotlibrc states."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_RC)
        yield


def styled(make: Callable[P, T]) -> Callable[P, T]:
    """Run a drawing function within `house_style`."""

    @wraps(make)
    def run(*args: P.args, **kwargs: P.kwargs) -> T:
        with house_style():
            return make(*args, **kwargs)

    return run


@styled
def new_figure(width: float, height: float) -> Figure:
    """Make a figure of a width and height [inch], laid out so that nothing overlaps."""
    return Figure(figsize=(width, height), layout="constrained")


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure; the file appears whole or not at all.

    The same figure gives the same bytes every time.

    Args:
        path: a name ending in .svg, .png or .pdf, which sets the format.

    Raises:
        GoughError: another ending, no such folder, a full disk.
    """
    ending = _ending(path)
    metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(ending)
    with house_style(), replacing(path) as file:
        figure.savefig(file, format=ending[1:], dpi=DPI, metadata=metadata)


def check_picture(path: str | Path) -> None:
    """Raise if no picture can be written to `path`; the path is not touched.

    Raises:
        GoughError: an unknown ending, no such folder, or a folder.
    """
    _ending(path)
    check_target(path)


def _ending(path: str | Path) -> str:
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise GoughError(f"{path}: a picture's name must end in .svg, .png or .pdf")
    return ending


# ---- text on pictures ---------------------------------------------------------------


def length_unit(platform: Platform) -> str:
    """Name of the length unit, or "unit" where the platform states none."""
    return platform.unit or "unit"


def reading_unit(platform: Platform) -> str:
    """Unit of readings on pictures, where motor angles are in degrees."""
    return "deg" if platform.legs == "rotary" else length_unit(platform)


def reading_name(platform: Platform) -> str:
    """Name of a reading, for an axis."""
    names = {"telescopic": "leg length", "length_change": "leg length from home"}
    return names.get(platform.legs, "motor angle")


def shown_readings(platform: Platform, readings: Array) -> Array:
    """Readings (...) in `reading_unit`."""
    return np.degrees(readings) if platform.legs == "rotary" else readings


def label_number(value: float, size: float) -> str:
    """Text of a number, to four digits of `size`, without a sign on zero."""
    return f"{value:z.{decimals(size, 4)}f}".replace("-", MINUS)


def pose_text(platform: Platform, pose: Pose, frame: str | None = None) -> str:
    """Position and Euler angles of one pose of the platform, or of a frame, in two lines."""
    pose = platform.frame(frame).of(pose) if frame else pose
    sizes = 3 * [platform.size / 10] + 3 * [10.0]
    numbers = list(map(label_number, pose_values(pose, "deg"), sizes))
    lengths, angles = ", ".join(numbers[:3]), ", ".join(numbers[3:])
    return f"({lengths}) {platform.unit}".rstrip() + f"\n({angles}) deg"


def muted(name: str, low: float, high: float) -> Colormap:
    """Part of a colour map, from `low` to `high` of its range, without ends that print badly."""
    return LinearSegmentedColormap.from_list(
        f"{name}_{low}_{high}", mpl.colormaps[name](np.linspace(low, high, 256))
    )
