"""The page and its state: requests arrive in a queue, and one thread handles them in order."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from gough.platform import Platform
from gough.pose import Pose
from gough.view.export import page
from gough.view.model import Model
from gough.view.panel import FIND, Panel
from gough.view.scene import Scene
from gough.view.server import close_server, open_server
from gough.view.trajectory import Trajectory

if TYPE_CHECKING:
    import viser

    from gough.modes.result import AssemblyModes

SAME_POSE = 1e-7  # translation / size + rotation [rad] below which a mode is the picture's pose
PANEL_PERIOD = 1 / 20  # [s] between changes of the panel's numbers
FRAME = 1 / 60  # [s] between rows of a file
BROWSER_WAIT = 2.0  # [s] for a browser to draw before the solver is compiled
UNDO_PAUSE = 1.0  # [s] without a request, after which Undo counts a new move
COMPILING = (
    "The solver is being compiled, which takes some seconds the first time. Sliders of the pose "
    "and the handle work already; sliders of the legs and modes follow."
)
SEARCHING = "Searching for all poses with these readings (compiled on first use: some seconds) ..."
OUTDATED = f"The readings have changed since the modes were found: press “{FIND}”."
CONTINUOUS = ("legs", "numbers", "drag", "row", "tick")  # only the newest request counts
MOVES = ("legs", "numbers", "drag", "home", "pick")  # requests that Undo takes back


class RequestQueue:
    """Requests from the page that are not handled yet; of a dragged slider, the newest only."""

    def __init__(self) -> None:
        self._queue: deque[tuple[str, dict]] = deque()
        self._changed = threading.Condition()

    def post(self, kind: str, values: dict) -> None:
        """Add a request; a continuous one is merged with the same kind at the end of the queue."""
        with self._changed:
            if kind in CONTINUOUS and self._queue and self._queue[-1][0] == kind:
                self._queue[-1][1].update(values)
            else:
                self._queue.append((kind, dict(values)))
            self._changed.notify()

    def get(self, timeout: float | None) -> tuple[str, dict] | None:
        """Return the next request, or None after `timeout` seconds without one."""
        with self._changed:
            self._changed.wait_for(lambda: self._queue, timeout)
            return self._queue.popleft() if self._queue else None


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
    ) -> None:
        """Draw the machine at `start` or at home, and compile the solver in the background.

        Raises:
            GoughError: the port is taken.
        """
        self.platform, self.trajectory = platform, trajectory
        self.model = Model(platform, start)
        self.server = open_server(host, port, f"gough · {platform.name}")
        self._requests = RequestQueue()
        self.scene = Scene(self.server, platform)
        self.panel = Panel(self.server, platform, self._requests.post, trajectory)
        self._note, self._ready, self._dragging = COMPILING, False, False
        self._modes: AssemblyModes | None = None
        self._last_move = "", 0.0
        self._row, self._playing, self._speed = 0, False, 1.0
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
        self._playing = False
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
        shown, stale = 0.0, False
        while True:
            request = self._requests.get(PANEL_PERIOD if stale else None)
            if request is not None:
                kind, values = request
                if kind == "close":
                    return
                self._remember(kind)
                getattr(self, f"_on_{kind}")(values)
                self._draw()
            # the picture moves more often than numbers can be read
            stale = request is not None and time.monotonic() - shown < PANEL_PERIOD
            if not stale:
                self._show_panel()
                shown = time.monotonic()

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
        from gough.view.follow import follow

        self._connected.wait(BROWSER_WAIT)
        home, legs = self.platform.home, self.platform.home_legs
        nowhere = np.full(6, 1e3 * self.platform.size)  # no pose has these: all restarts
        for target in (legs, nowhere):
            follow(self.model.solver, home, legs, target)
        self._requests.post("ready", {})

    def _play(self) -> None:
        """Post rows at the speed of the player, until the last."""
        assert self.trajectory is not None
        times = self.trajectory.time
        if self._row >= len(times) - 1:
            self._row = 0
        now, last = float(times[self._row]), time.monotonic()
        while self._playing and now < times[-1]:
            time.sleep(FRAME)
            begin, last = last, time.monotonic()
            now += self._speed * (last - begin)
            if self._playing:
                row = int(np.searchsorted(times, now, side="right")) - 1
                self._requests.post("tick", {"row": max(0, row)})
        self._requests.post("pause", {})

    def _find(self, legs: np.ndarray) -> None:
        from gough.modes.assembly import assembly_modes

        self._requests.post("found", {"modes": assembly_modes(self.platform, legs)})

    # ---- requests ---------------------------------------------------------------------

    def _on_ready(self, _: dict) -> None:
        self._note, self._ready = "", True
        self.panel.enable(True)

    def _on_legs(self, readings: dict) -> None:
        if self._ready:
            self._playing = False
            self.model.ask_legs(readings)

    def _on_numbers(self, values: dict) -> None:
        self._playing = False
        self.model.ask_numbers(values)

    def _on_drag(self, what: dict) -> None:
        self._playing, self._dragging = False, True
        self.model.ask_pose(self.scene.pose_of_handle(what["position"], what["wxyz"]))

    def _on_drop(self, _: dict) -> None:
        self._dragging = False

    def _on_home(self, _: dict) -> None:
        self._playing = False
        self.model.home()
        self.panel.reset_ranges()

    def _on_undo(self, _: dict) -> None:
        self._playing, self._last_move = False, ("", 0.0)
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
        self.scene.show_modes(modes.pose, modes.legs, modes.sign, pick)

    def _on_pick(self, what: dict) -> None:
        if self._modes is not None:
            index = what["mode"]
            pose, residual = self._modes.pose[index], float(self._modes.residual[index])
            self.model.pick(pose, residual)

    def _on_row(self, what: dict) -> None:
        self._playing = False
        self._show_row(what)

    def _on_tick(self, what: dict) -> None:
        if self._playing:  # else it has been paused meanwhile
            self._show_row(what)

    def _on_play(self, _: dict) -> None:
        self._playing = not self._playing
        if self._playing:
            self._start(self._play)

    def _on_pause(self, _: dict) -> None:
        self._playing = False

    def _on_speed(self, what: dict) -> None:
        self._speed = what["speed"]

    def _on_save(self, what: dict) -> None:
        self._start(self._save, what["client"])

    def _save(self, client: viser.ClientHandle | None) -> None:
        html = page(self.model).encode()
        name = f"{self.platform.name}.html"
        (client or self.server).send_file_download(name, html, save_immediately=True)

    # ---- the picture ------------------------------------------------------------------

    def _show_row(self, what: dict) -> None:
        assert self.trajectory is not None
        self._row = i = what["row"]
        rows = self.trajectory
        self.model.show(rows.pose[i], rows.legs[i], rows.answers[i])

    def _draw(self) -> None:
        """Draw the model's pose."""
        if self._modes is not None and not np.array_equal(self._modes.legs, self.model.legs):
            self._modes = None
            self.scene.clear_modes()
            self.panel.modes.clear(OUTDATED)
        self.scene.draw(self.model.pose, self.model.legs, handle=not self._dragging)

    def _show_panel(self) -> None:
        """Show the model's numbers."""
        self.panel.modes.mark(self._shown_mode())
        with self.server.atomic():
            self.panel.show(self.model, self._note)
            if self.panel.player is not None:
                self.panel.player.show(self._row, self._playing)

    def _shown_mode(self) -> int | None:
        """Index of the mode in the picture, or None."""
        if self._modes is None or not len(self._modes.row):
            return None
        translation, rotation = self._modes.pose.distance(self.model.pose)
        gap = translation / self.platform.size + rotation
        best = int(np.argmin(gap))
        return best if gap[best] < SAME_POSE else None

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
