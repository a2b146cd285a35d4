"""The panel beside the picture: sliders, status, modes and the player."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import viser

from gough.checks import Array
from gough.platform import Platform
from gough.view import colors, words
from gough.view.model import Model
from gough.view.ranges import Range, leg_factor, leg_ranges, pose_ranges
from gough.view.trajectory import Trajectory

if TYPE_CHECKING:
    from gough.modes.result import AssemblyModes

Post = Callable[[str, dict], None]  # takes the name of a wish, and what is wished for
SPEEDS = ("0.1x", "0.25x", "0.5x", "1x", "2x", "5x", "10x", "100x")
FIND = "Find all assembly modes"


class Panel:
    """Everything in the panel. It changes nothing itself: wishes go to `post`."""

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
        self._gui.add_html(words.legend(platform))
        tabs = self._gui.add_tab_group()
        if trajectory is not None:
            with tabs.add_tab("File"):
                self.player = PlayerPanel(self._gui, trajectory, post)
        with tabs.add_tab("Move"):
            self._add_sliders()
        with tabs.add_tab("Modes"):
            self.modes = ModesPanel(self._gui, platform, post)

    def show(self, model: Model, note: str) -> None:
        """Bring all numbers and sentences up to date."""
        self._card.content = words.status_card(model, note)
        self._back.disabled = model.answer.reached
        for slider, value in zip(self._legs, self._factor * model.asked, strict=True):
            slider.show(value)
        for slider, value in zip(self._pose, model.numbers, strict=True):
            slider.show(value)

    def enable(self, ready: bool) -> None:
        """Allow, or not yet, what needs the compiled solver."""
        for slider in self._legs:
            slider.handle.disabled = not ready
        self.modes.find.disabled = not ready

    def _add_sliders(self) -> None:
        what = "Motors" if self._platform.legs == "rotary" else "Legs"
        with self._gui.add_folder(words.with_unit(what, words.leg_unit(self._platform))):
            wish = self._wish("legs", 1 / self._factor)
            self._legs = [
                Slider(self._gui, f"{i + 1}", one, wish(i))
                for i, one in enumerate(leg_ranges(self._platform))
            ]
        unit = f"{self._platform.unit}, deg".lstrip(", ")
        with self._gui.add_folder(words.with_unit("Pose", unit)):
            wish = self._wish("numbers", 1.0)
            self._pose = [
                Slider(self._gui, name, one, wish(i))
                for i, (name, one) in enumerate(
                    zip(words.POSE_NAMES, pose_ranges(self._platform), strict=True)
                )
            ]
        self._back = self._button("Back to what the picture shows", "forget", disabled=True)
        self._button("Home", "home")
        handle = self._gui.add_checkbox("Drag handle", True)
        handle.on_update(_later(lambda: self._post("handle", {"visible": handle.value})))
        self._button("Save this as a page", "save", hint="one HTML file that opens anywhere")

    def _wish(self, kind: str, factor: float) -> Callable[[int], Callable[[float], None]]:
        return lambda i: lambda value: self._post(kind, {i: factor * value})

    def _button(self, label: str, kind: str, **options: Any) -> viser.GuiButtonHandle:
        button = self._gui.add_button(label, **options)

        @button.on_click
        async def _(event: viser.GuiEvent) -> None:
            self._post(kind, {"client": event.client})

        return button


class Slider:
    """One number that can be dragged or typed.

    Values from the library are shown rounded; only what a person sets comes back, so that a
    number which nobody touched keeps all its digits.
    """

    def __init__(
        self, gui: viser.GuiApi, label: str, ends: Range, wish: Callable[[float], None]
    ) -> None:
        self._ends = ends
        middle = round((ends.low + ends.high) / 2, ends.decimals)
        self.handle = gui.add_slider(
            label, ends.low, ends.high, 10.0**-ends.decimals, float(middle), marks=()
        )
        self.handle.precision = ends.decimals

        @self.handle.on_update
        async def _(event: viser.GuiEvent) -> None:
            if event.client_id is not None:  # else it is `show` that set it
                wish(self.handle.value)

    def show(self, value: float) -> None:
        """Set the number, and widen the slider where it has to be."""
        if self._ends.reach(float(value)):
            self.handle.min, self.handle.max = self._ends.low, self._ends.high
        rounded = round(float(value), self._ends.decimals)
        # half a step away is what a person set, from which rounding must not drag it off
        if abs(rounded - self.handle.value) > 1e-9 * (self._ends.high - self._ends.low):
            self.handle.value = rounded


class ModesPanel:
    """The list of assembly modes: one button each."""

    def __init__(self, gui: viser.GuiApi, platform: Platform, post: Post) -> None:
        self._gui, self._platform, self._post = gui, platform, post
        self.find = gui.add_button(FIND)

        @self.find.on_click
        async def _(_: viser.GuiEvent) -> None:
            post("find", {})

        self._text = gui.add_markdown("Other poses with the same leg readings, each proven.")
        self._list = gui.add_folder("Click one to make it the present pose", visible=False)
        self._buttons: dict[int, viser.GuiButtonHandle] = {}

    def show(self, modes: AssemblyModes) -> None:
        """List every mode, as `gough modes` orders and numbers them."""
        from gough.modes.choose import choose_mode
        from gough.status import ModesStatus

        self.clear("")
        choice = choose_mode(modes)
        euler = np.degrees(modes.pose.euler)
        self._list.visible = len(modes.row) > 0
        with self._list:
            for number, i in enumerate(np.argsort(choice.rank), 1):
                fails = [name for name, passed in choice.passes.items() if not passed[i]]
                self._add(
                    int(i), words.mode_label(number, modes.pose.position[i], euler[i],
                    self._platform), float(modes.sign[i]), fails,
                )  # fmt: skip
        status = ModesStatus(int(modes.status))
        certified = int(modes.certified.sum())
        self._text.content = (
            f"**{len(modes.row)} poses** have these readings, {certified} of them proven. "
            f"{status.text} Blue: on home's side of the singularities; vermilion: beyond one. "
            "Click a line here, or a ghost."
        )

    def clear(self, text: str) -> None:
        """Empty the list, and say why."""
        for button in self._buttons.values():
            button.remove()
        self._buttons, self._list.visible = {}, False
        self._text.content = text

    def mark(self, shown: int | None) -> None:
        """Mark the one mode that the picture shows."""
        for index, button in self._buttons.items():
            button.icon = viser.Icon.EYE if index == shown else None

    def _add(self, index: int, label: str, sign: float, fails: list[str]) -> None:
        color = colors.rgb(colors.SAME if sign > 0 else colors.OTHER)
        hint = f"fails: {', '.join(fails)}" if fails else "passes every filter"
        button = self._gui.add_button(label, color=color, hint=hint)
        self._buttons[index] = button

        @button.on_click
        async def _(_: viser.GuiEvent) -> None:
            self._post("pick", {"mode": index})


class PlayerPanel:
    """Time slider, play and pause, speed."""

    def __init__(self, gui: viser.GuiApi, trajectory: Trajectory, post: Post) -> None:
        self._trajectory = trajectory
        self._text = gui.add_markdown(f"{trajectory.about}\n\n")
        last = max(len(trajectory) - 1, 1)
        self.slider = gui.add_slider("row", 0, last, 1, 0, disabled=len(trajectory) < 2, marks=())
        self._where = gui.add_markdown("")
        self._play = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY)
        speed = gui.add_dropdown("speed", SPEEDS, initial_value="1x", hint=trajectory.pace)

        @self.slider.on_update
        async def _(event: viser.GuiEvent) -> None:
            if event.client_id is not None:
                post("row", {"row": int(self.slider.value)})

        @self._play.on_click
        async def _(_: viser.GuiEvent) -> None:
            post("play", {})

        @speed.on_update
        async def _(_: viser.GuiEvent) -> None:
            post("speed", {"speed": float(speed.value.removesuffix("x"))})

    def show(self, row: int, playing: bool) -> None:
        """Bring slider, button and text to a row."""
        self.slider.value = row
        self._play.label = "Pause" if playing else "Play"
        self._where.content = self._trajectory.where(row)


def _later(action: Callable[[], None]) -> Callable[[Any], Any]:
    """As a callback that runs in the order of events, which those on threads need not."""

    async def callback(_: Any) -> None:
        action()

    return callback


def row_of(values: Array, value: float) -> int:
    """The last of rising values (N,) that is not above a value; the first if all are."""
    return max(0, int(np.searchsorted(values, value, side="right")) - 1)
