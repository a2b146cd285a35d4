"""The page and its state: requests arrive in a queue, and one thread handles them in order."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from gough.platform import Platform
from gough.pose import Pose
from gough.view.export import page
from gough.view.model import Model
from gough.view.panel import Panel
from gough.view.player import Player
from gough.view.requests import Pace, RequestQueue
from gough.view.scene import Scene
from gough.view.server import close_server, open_server
from gough.view.tabs import FIND
from gough.view.trajectory import Trajectory

if TYPE_CHECKING:
    import viser

    from gough.modes.result import AssemblyModes

PANEL_PERIOD = 1 / 20  # [s] between changes of the panel's numbers
REACH_PERIOD = 1 / 10  # [s] between changes of the bars, which take some milliseconds
BROWSER_WAIT = 2.0  # [s] for a browser to draw before the solver is compiled
UNDO_PAUSE = 1.0  # [s] without a request, after which Undo counts a new move
COMPILING = (
    "The solver is being compiled, which takes some seconds the first time. Sliders of the pose "
    "and the handle work already; sliders of the legs and modes follow."
)
SEARCHING = "Searching for all poses with these readings (compiled on first use: some seconds) ..."
OUTDATED = f"The readings have changed since the modes were found: press “{FIND}”."
MOVES = ("legs", "numbers", "drag", "home", "pick")  # requests that Undo takes back


class Viewer:
    """Page with one machine, served until `close`."""

    def __init__(
        self,
        platform: Platform,
        *,
        host: str = "localhost",
        port: int | None = None,
        trajectory: Trajectory | None = None,
        start: Pose | None = None,
        frame: str | None = None,
    ) -> None:
        """Draw the machine at `start` or at home, and compile the solver in the background.

        Args:
            start: a pose of the platform.
            frame: whose pose the page shows and takes, such as "tool in work".

        Raises:
            GoughError: the port is taken, or there is no such frame.
        """
        self.platform, self.trajectory = platform, trajectory
        self.model = Model(platform, start, frame)
        self.server = open_server(host, port, f"gough · {platform.name}")
        self._requests = RequestQueue()
        self.scene = Scene(self.server, platform, self.model.view)
        self.panel = Panel(self.server, self.model, self._requests.post, trajectory)
        self._note, self._ready, self._dragging = COMPILING, False, False
        self._modes: AssemblyModes | None = None
        self._last_move = "", 0.0
        self._player = Player(trajectory)
        self._reached: Pose | None = None  # the pose that the bars are those of
        self._failure: BaseException | None = None
        self._connected = threading.Event()
        self.server.on_client_connect(lambda _: self._connected.set())
        self._listen_to_handle()
        self.panel.enable(False)
        if trajectory is not None:
            self.scene.show_path(trajectory.pose)
            self._show_row({"row": 0})
        self._draw()
        self._show_panel()
        self._worker = self._start(self._work)
        self._start(self._prepare)

    @property
    def port(self) -> int:
        """Port of the page."""
        return self.server.get_port()

    def wait(self) -> None:
        """Serve until a signal interrupts; an error in a thread is raised."""
        while self._failure is None:
            time.sleep(0.1)
        raise self._failure

    def close(self) -> None:
        """End the server and its threads; compiling is waited for."""
        self._player.playing = False
        self._requests.post("close", {})
        self._worker.join()
        close_server(self.server)

    # ---- threads ----------------------------------------------------------------------

    def _start(self, work: Callable[..., None], *arguments: Any) -> threading.Thread:
        """Run `work` in a thread; `wait` raises its exceptions in the main thread."""

        def run() -> None:
            try:
                work(*arguments)
            except BaseException as error:
                self._failure = error

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        return thread

    def _work(self) -> None:
        """Handle requests, one after the other."""
        # the picture moves more often than numbers can be read
        paces = (Pace(PANEL_PERIOD), self._show_panel), (Pace(REACH_PERIOD), self._show_reach)
        while True:
            now = time.monotonic()
            waits = [wait for pace, _ in paces if (wait := pace.wait(now)) is not None]
            request = self._requests.get(min(waits, default=None))
            if request is not None:
                kind, values = request
                if kind == "close":
                    return
                self._remember(kind)
                getattr(self, f"_on_{kind}")(values)
                self._draw()
                for pace, _ in paces:
                    pace.ask()
            for pace, work in paces:
                if pace.start(time.monotonic()):
                    work()

    def _remember(self, kind: str) -> None:
        """Keep the pose for Undo where a new move begins."""
        if kind not in MOVES:
            return
        now = time.monotonic()
        if kind != self._last_move[0] or now - self._last_move[1] > UNDO_PAUSE:
            self.model.remember()
        self._last_move = kind, now

    def _prepare(self) -> None:
        """Compile the solver, once the browser has drawn the first picture."""
        self._connected.wait(BROWSER_WAIT)
        self.model.compile()
        self._requests.post("ready", {})

    def _find(self, legs: np.ndarray) -> None:
        from gough.modes.assembly import assembly_modes

        found = assembly_modes(self.platform, legs, frame=self.model.frame or None)
        self._requests.post("found", {"modes": found})

    # ---- requests ---------------------------------------------------------------------

    def _on_ready(self, _: dict) -> None:
        self._note, self._ready = "", True
        self.panel.enable(True)
        self.panel.show_reach(self.model.reach(self.platform.home), home=True)

    def _on_legs(self, readings: dict) -> None:
        if self._ready:
            self._player.playing = False
            self.model.ask_legs(readings)

    def _on_numbers(self, values: dict) -> None:
        self._player.playing = False
        self.model.ask_numbers(values)

    def _on_drag(self, what: dict) -> None:
        self._player.playing, self._dragging = False, True
        self.model.ask_pose(self.scene.pose_of_handle(what["position"], what["wxyz"]))

    def _on_drop(self, _: dict) -> None:
        self._dragging = False

    def _on_home(self, _: dict) -> None:
        self._player.playing = False
        self.model.home()
        self.panel.reset_ranges()

    def _on_undo(self, _: dict) -> None:
        self._player.playing, self._last_move = False, ("", 0.0)
        self.model.undo()

    def _on_handle(self, _: dict) -> None:
        if self.scene.handle is not None:
            self.scene.handle.visible = not self.scene.handle.visible

    def _on_camera(self, what: dict) -> None:
        client: viser.ClientHandle | None = what["client"]
        if client is not None:
            with client.atomic():
                place, target, up = self.scene.camera(what["view"])
                client.camera.up_direction = up
                client.camera.position, client.camera.look_at = place, target

    def _on_find(self, _: dict) -> None:
        self.panel.modes.find.disabled = True
        self.panel.modes.clear(SEARCHING)
        self._start(self._find, self.model.legs)

    def _on_found(self, what: dict) -> None:
        modes: AssemblyModes = what["modes"]
        self.panel.modes.find.disabled = False
        if not np.array_equal(modes.legs, self.model.legs):
            self.panel.modes.clear(OUTDATED)
            return
        self._modes = modes
        self.panel.modes.show(modes)
        pick = lambda index: self._requests.post("pick", {"mode": index})  # noqa: E731
        self.scene.show_modes(modes.platform_pose, modes.legs, modes.sign, pick)

    def _on_pick(self, what: dict) -> None:
        if self._modes is not None:
            index = what["mode"]
            pose, residual = self._modes.platform_pose[index], float(self._modes.residual[index])
            self.model.pick(pose, residual)

    def _on_row(self, what: dict) -> None:
        self._player.playing = False
        self._show_row(what)

    def _on_tick(self, what: dict) -> None:
        if self._player.playing:  # else it has been paused meanwhile
            self._show_row(what)

    def _on_play(self, _: dict) -> None:
        self._player.playing = not self._player.playing
        if self._player.playing:
            self._start(self._player.run, self._requests.post)

    def _on_pause(self, _: dict) -> None:
        self._player.playing = False

    def _on_speed(self, what: dict) -> None:
        self._player.speed = what["speed"]

    def _on_save(self, what: dict) -> None:
        self._start(self._save, what["client"])

    def _save(self, client: viser.ClientHandle | None) -> None:
        html = page(self.model).encode()
        name = f"{self.platform.name}.html"
        (client or self.server).send_file_download(name, html, save_immediately=True)

    # ---- the picture ------------------------------------------------------------------

    def _show_row(self, what: dict) -> None:
        assert self.trajectory is not None
        self._player.row = i = what["row"]
        rows = self.trajectory
        self.model.show(rows.pose[i], rows.legs[i], rows.answers[i])

    def _draw(self) -> None:
        """Draw the model's pose."""
        if self._modes is not None and not np.array_equal(self._modes.legs, self.model.legs):
            self._modes = None
            self.scene.clear_modes()
            self.panel.modes.clear(OUTDATED)
        model = self.model
        dragged = self._dragging
        self.scene.draw(model.pose, model.legs, beyond=model.beyond, handle=not dragged)

    def _show_panel(self) -> None:
        """Show the model's numbers."""
        self.panel.modes.mark(self.model.mode(self._modes))
        with self.server.atomic():
            self.panel.show(self.model, self._note)
            if self.panel.player is not None:
                self.panel.player.show(self._player.row, self._player.playing)

    def _show_reach(self) -> None:
        """Show how far each axis can still move, once that is compiled."""
        if self._ready and self._reached is not self.model.pose:
            self._reached = self.model.pose
            self.panel.show_reach(self.model.reach(self.model.pose))

    def _listen_to_handle(self) -> None:
        handle = self.scene.handle
        assert handle is not None

        @handle.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            where = {"position": np.array(handle.position), "wxyz": np.array(handle.wxyz)}
            if event.phase == "end":
                self._requests.post("drop", {})
            elif event.phase == "update":
                self._requests.post("drag", where)
