"""The panel beside the picture: status, sliders, what is left from here, and two tabs more.

Controls change nothing themselves: they post requests to the viewer.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import viser

from gough.text import with_unit
from gough.view.beyond import leg_factor, leg_unit
from gough.view.html_parts import POSE_NAMES, legend, numbers_table, status_card
from gough.view.model import Model
from gough.view.reach_bars import ReachBars
from gough.view.scene import VIEWS
from gough.view.sliders import Range, Slider, leg_ranges, pose_ranges
from gough.view.tabs import ModesPanel, PlayerPanel, Post
from gough.view.trajectory import Trajectory

if TYPE_CHECKING:
    from gough.margins import Reach


class Panel:
    """All controls of the page, with the methods that bring them up to date."""

    def __init__(
        self,
        server: viser.ViserServer,
        model: Model,
        post: Post,
        trajectory: Trajectory | None = None,
    ) -> None:
        platform = model.platform
        self._gui, self._platform, self._post = server.gui, platform, post
        self._view = model.view
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

    def show_reach(self, reach: Reach, *, home: bool = False) -> None:
        """Show how far each axis of the pose can still move.

        Args:
            home: scale the bars by these ways, which are those from home.
        """
        if home:
            self._left.set_scale(reach)
        self._left.show(reach)

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
        whose = "Position, rotation" if self._view is None else self._view.name
        with self._gui.add_folder(with_unit(whose, unit)):
            ranges = pose_ranges(self._platform, self._view)
            self._pose = self._sliders(POSE_NAMES, ranges, "numbers", 1.0)
        self._left = ReachBars(self._gui, self._platform, self._view)

    def _sliders(self, names, ranges: list[Range], kind: str, factor: float) -> list[Slider]:
        def request(i: int) -> Callable[[float], None]:
            return lambda value: self._post(kind, {i: factor * value})

        pairs = zip(names, ranges, strict=True)
        return [Slider(self._gui, name, one, request(i)) for i, (name, one) in enumerate(pairs)]
