"""The panel beside the picture: status, sliders, assembly modes and the player of a file.

Controls change nothing themselves: they post requests to the viewer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import viser

from gough.platform import Platform
from gough.pose import pose_values
from gough.text import decimals, with_unit
from gough.view import meshes
from gough.view.export import (
    POSE_NAMES,
    legend,
    mode_label,
    numbers_table,
    row_text,
    status_card,
    strip,
)
from gough.view.model import Model, leg_factor, leg_unit
from gough.view.scene import VIEWS
from gough.view.trajectory import Trajectory

if TYPE_CHECKING:
    from gough.modes.result import AssemblyModes

Post = Callable[[str, dict], None]  # takes the kind of a request and its values
SPEEDS = ("0.1x", "0.25x", "0.5x", "1x", "2x", "5x", "10x", "100x")
FIND = "Find all assembly modes"

STEPS = 5000  # least number of steps of a slider
BEYOND_STROKE = 0.25  # of the stroke, so that its end can be crossed
BEYOND_WORKSPACE = 2.0  # range of a slider / workspace
LEG_REACH = 0.3  # of a leg's length, without a stroke
MOTOR_REACH = 120.0  # [deg]
TRANSLATION, ROTATION = 0.25, 45.0  # of the size, and [deg], without a workspace
LEAST_TRANSLATION, LEAST_ROTATION = 0.005, 1.0  # the same, whatever is stated


class Panel:
    """All controls of the page, with the methods that bring them up to date."""

    def __init__(
        self,
        server: viser.ViserServer,
        platform: Platform,
        post: Post,
        trajectory: Trajectory | None = None,
    ) -> None:
        self._gui, self._platform, self._post = server.gui, platform, post
        self._factor = leg_factor(platform)
        self._card = self._gui.add_html("")
        self._gui.add_html(legend(platform))
        tabs = self._gui.add_tab_group()
        self.player = None
        if trajectory is not None:
            with tabs.add_tab("File"):
                self.player = PlayerPanel(self._gui, platform, trajectory, post)
        with tabs.add_tab("Move"):
            self._add_buttons()
            self._add_sliders()
        with tabs.add_tab("Modes"):
            self.modes = ModesPanel(self._gui, platform, post)

    def show(self, model: Model, note: str) -> None:
        """Bring all numbers and sentences up to date."""
        self._card.content = status_card(model, note)
        for slider, value in zip(self._legs, self._factor * model.asked, strict=True):
            slider.show(value)
        for slider, value in zip(self._pose, model.numbers, strict=True):
            slider.show(value)
        if self.player is not None:
            self.player.numbers.content = numbers_table(model)

    def enable(self, ready: bool) -> None:
        """Enable the controls that need the compiled solver."""
        for slider in self._legs:
            slider.handle.disabled = not ready
        self.modes.find.disabled = not ready

    def reset_ranges(self) -> None:
        """Take back all growth of the sliders' ranges."""
        for slider in (*self._legs, *self._pose):
            slider.reset()

    def _add_buttons(self) -> None:
        self._button_group("Pose", ("Home", "Undo", "Save page"))
        self._button_group("View", (*VIEWS, "Handle"))

    def _button_group(self, label: str, names: tuple[str, ...]) -> None:
        group = self._gui.add_button_group(label, names)

        @group.on_click
        async def _(event: viser.GuiEvent) -> None:
            kind = "camera" if group.value in VIEWS else group.value.split()[0].lower()
            self._post(kind, {"client": event.client, "view": group.value})

    def _add_sliders(self) -> None:
        what = "Motors" if self._platform.legs == "rotary" else "Legs"
        with self._gui.add_folder(with_unit(what, leg_unit(self._platform))):
            names = [f"{i + 1}" for i in range(6)]
            self._legs = self._sliders(names, leg_ranges(self._platform), "legs", 1 / self._factor)
        unit = f"{self._platform.unit}, deg".lstrip(", ")
        with self._gui.add_folder(with_unit("Position, rotation", unit)):
            ranges = pose_ranges(self._platform)
            self._pose = self._sliders(POSE_NAMES, ranges, "numbers", 1.0)

    def _sliders(self, names, ranges: list[Range], kind: str, factor: float) -> list[Slider]:
        def request(i: int) -> Callable[[float], None]:
            return lambda value: self._post(kind, {i: factor * value})

        pairs = zip(names, ranges, strict=True)
        return [Slider(self._gui, name, one, request(i)) for i, (name, one) in enumerate(pairs)]


# ---- sliders --------------------------------------------------------------------------


@dataclass
class Range:
    """Ends of one slider, and the stated limits between them; grows to hold a value."""

    low: float
    high: float
    limits: tuple[float, float] | None = None

    @property
    def decimals(self) -> int:
        """Digits after the point, for 5000 to 50,000 steps."""
        return decimals((self.high - self.low) / STEPS, 1)

    def reach(self, value: float) -> bool:
        """Grow to hold `value`; True if that was needed."""
        inside = self.low <= value <= self.high
        if not inside:
            spare = 0.1 * (self.high - self.low)
            self.low = round(min(self.low, value - spare), self.decimals)
            self.high = round(max(self.high, value + spare), self.decimals)
        return not inside


class Slider:
    """One number that can be dragged or typed, with marks at its limits.

    Values from the library are shown rounded. Only what a person sets is posted, so that a
    number which nobody touched keeps all its digits.
    """

    def __init__(
        self, gui: viser.GuiApi, label: str, ends: Range, request: Callable[[float], None]
    ) -> None:
        self._first, self._ends = (ends.low, ends.high), ends
        middle = round((ends.low + ends.high) / 2, ends.decimals)
        limits = (ends.low, ends.high) if ends.limits is None else ends.limits
        self.handle = gui.add_slider(
            label, ends.low, ends.high, 10.0**-ends.decimals, float(middle),
            marks=tuple((value, f"{value:.5g}") for value in limits),
        )  # fmt: skip
        self.handle.precision = ends.decimals

        @self.handle.on_update
        async def _(event: viser.GuiEvent) -> None:
            if event.client_id is not None:  # else `show` has set it
                request(self.handle.value)

    def show(self, value: float) -> None:
        """Set the number, and widen the slider if need be."""
        if self._ends.reach(float(value)):
            self.handle.min, self.handle.max = self._ends.low, self._ends.high
        rounded = round(float(value), self._ends.decimals)
        # a person may have set a value half a step away, which rounding must not change
        if abs(rounded - self.handle.value) > 1e-9 * (self._ends.high - self._ends.low):
            self.handle.value = rounded

    def reset(self) -> None:
        """Set the ends that the slider had at first."""
        if (self._ends.low, self._ends.high) != self._first:
            self._ends.low, self._ends.high = self._first
            self.handle.min, self.handle.max = self._first


def leg_ranges(platform: Platform) -> list[Range]:
    """Ranges of the six leg sliders: the stroke and a little more."""
    home = leg_factor(platform) * platform.home_legs
    if platform.stroke is not None:
        low, high = leg_factor(platform) * platform.stroke.T
        spare = BEYOND_STROKE * (high - low)
        return _ranges(low - spare, high + spare, leg_factor(platform) * platform.stroke)
    if platform.legs == "rotary":
        return _ranges(home - MOTOR_REACH, home + MOTOR_REACH)
    reach = LEG_REACH * platform.home_lengths
    return _ranges(home - reach, home + reach)


def pose_ranges(platform: Platform) -> list[Range]:
    """Ranges of x, y, z [platform unit] and rx, ry, rz [deg]: the workspace and more."""
    home = pose_values(platform.home, "deg")
    reach = np.repeat([TRANSLATION * platform.size, ROTATION], 3)
    box, limits = np.stack([-reach, reach], axis=1), None
    if platform.workspace is not None:
        stated = np.concatenate([platform.workspace.translation, platform.workspace.rotation_deg])
        box, limits = BEYOND_WORKSPACE * stated, home[:, None] + stated
    least = np.repeat([LEAST_TRANSLATION * platform.size, LEAST_ROTATION], 3)
    low, high = np.minimum(box[:, 0], -least), np.maximum(box[:, 1], least)
    return _ranges(home + low, home + high, limits)


def _ranges(low, high, limits=None) -> list[Range]:
    ranges = [Range(float(a), float(b)) for a, b in zip(low, high, strict=True)]
    for i, one in enumerate(ranges):
        decimals = one.decimals
        one.low, one.high = round(one.low, decimals), round(one.high, decimals)
        if limits is not None:
            one.limits = float(limits[i][0]), float(limits[i][1])
    return ranges


# ---- modes and file -------------------------------------------------------------------


class ModesPanel:
    """List of the assembly modes: one button each."""

    def __init__(self, gui: viser.GuiApi, platform: Platform, post: Post) -> None:
        self._gui, self._platform, self._post = gui, platform, post
        self.find = _button(gui, FIND, lambda: post("find", {}))
        self._text = gui.add_markdown("Other poses with the same leg readings, each proven.")
        self._list = gui.add_folder("Click one to make it the present pose", visible=False)
        self._buttons: dict[int, viser.GuiButtonHandle] = {}

    def show(self, modes: AssemblyModes) -> None:
        """List every mode, in the order and with the numbers of `gough modes`."""
        from gough.modes.choose import choose_mode
        from gough.status import ModesStatus

        self.clear("")
        choice = choose_mode(modes)
        numbers = pose_values(modes.pose, "deg")
        self._list.visible = len(modes.row) > 0
        with self._list:
            for number, i in enumerate(map(int, np.argsort(choice.rank)), 1):
                fails = [name for name, passed in choice.passes.items() if not passed[i]]
                self._buttons[i] = _button(
                    self._gui, mode_label(number, numbers[i], self._platform),
                    lambda i=i: self._post("pick", {"mode": i}),
                    color=meshes.rgb(meshes.SAME if modes.sign[i] > 0 else meshes.OTHER),
                    hint=f"fails: {', '.join(fails)}" if fails else "passes every filter",
                )  # fmt: skip
        status = ModesStatus(int(modes.status))
        self._text.content = (
            f"**{len(modes.row)} poses** have these readings, {int(modes.certified.sum())} of "
            f"them proven. {status.text} Blue: on home's side of the singularities; vermilion: "
            "beyond one. Click a line here, or a pale plate in the picture."
        )

    def clear(self, text: str) -> None:
        """Empty the list, and show `text` in its place."""
        for button in self._buttons.values():
            button.remove()
        self._buttons, self._list.visible = {}, False
        self._text.content = text

    def mark(self, shown: int | None) -> None:
        """Mark the mode in the picture."""
        for index, button in self._buttons.items():
            button.icon = viser.Icon.EYE if index == shown else None


class PlayerPanel:
    """Row slider, play and pause, speed, and the readings over time."""

    def __init__(
        self, gui: viser.GuiApi, platform: Platform, trajectory: Trajectory, post: Post
    ) -> None:
        self._trajectory = trajectory
        gui.add_markdown(trajectory.about)
        first, last, step = trajectory.numbers
        self.slider = gui.add_slider(
            "row", first, max(last, first + 1), step, first, disabled=last == first, marks=()
        )
        self._play = _button(gui, "Play", lambda: post("play", {}), icon=viser.Icon.PLAYER_PLAY)
        speed = gui.add_dropdown("speed", SPEEDS, initial_value="1x", hint=trajectory.pace)
        self._where = gui.add_html("")
        gui.add_html(strip(platform, trajectory))
        self.numbers = gui.add_html("")

        @self.slider.on_update
        async def _(event: viser.GuiEvent) -> None:
            if event.client_id is not None:
                post("row", {"row": (int(self.slider.value) - first) // step})

        @speed.on_update
        async def _(_: viser.GuiEvent) -> None:
            post("speed", {"speed": float(speed.value.removesuffix("x"))})

    def show(self, row: int, playing: bool) -> None:
        """Bring slider, button and text to a row."""
        self.slider.value = int(self._trajectory.number[row])
        self._play.label = "Pause" if playing else "Play"
        self._where.content = row_text(self._trajectory, row)


def _button(
    gui: viser.GuiApi, label: str, press: Callable[[], None], **options: Any
) -> viser.GuiButtonHandle:
    """Button whose presses are handled in the order of events, which threads would not keep."""
    button = gui.add_button(label, **options)

    @button.on_click
    async def _(_: viser.GuiEvent) -> None:
        press()

    return button
