"""Two tabs of the panel: the list of assembly modes, and the player of a file."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import viser

from gough.platform import Platform
from gough.pose import pose_values
from gough.view import meshes
from gough.view.html_parts import mode_label, row_text, strip
from gough.view.trajectory import Trajectory

if TYPE_CHECKING:
    from gough.modes.result import AssemblyModes

Post = Callable[[str, dict], None]  # takes the kind of a request and its values
SPEEDS = ("0.1x", "0.25x", "0.5x", "1x", "2x", "5x", "10x", "100x")
FIND = "Find all assembly modes"


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
