"""The page and what stands behind it: wishes come in, one thread carries them out in order."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from gough.platform import Platform
from gough.view import server as servers
from gough.view.export import page
from gough.view.model import Model
from gough.view.panel import FIND, Panel, row_of
from gough.view.scene import Scene
from gough.view.trajectory import Trajectory

if TYPE_CHECKING:
    import viser

    from gough.modes.result import AssemblyModes

SAME_POSE = 1e-7  # shares of the size and radians that tell modes from the picture's pose
SPEAKING = 1 / 20  # [s] between changes of the panel's numbers
FRAME = 1 / 60  # [s] between rows that are played
PATIENCE = 2.0  # [s] to wait for a browser before the solver is compiled
COMPILING = (
    "The solver is being compiled, which takes some seconds the first time. Pose sliders and the "
    "handle work already; leg sliders and modes as soon as it is done."
)
LOOKING = "Looking for all poses with these readings (the first time compiles for some seconds) ..."
OUTDATED = f"The readings have changed since the modes were found: press “{FIND}”."
# wishes of which only the newest counts
CONTINUOUS = ("legs", "numbers", "drag", "row", "tick")


class Wishes:
    """What was asked for and not yet done; of a slider that is being dragged, the newest only."""

    def __init__(self) -> None:
        self._queue: deque[tuple[str, dict]] = deque()
        self._news = threading.Condition()

    def post(self, kind: str, what: dict) -> None:
        """Ask for something; `what` of wishes of one kind in a row are merged."""
        with self._news:
            if kind in CONTINUOUS and self._queue and self._queue[-1][0] == kind:
                self._queue[-1][1].update(what)
            else:
                self._queue.append((kind, dict(what)))
            self._news.notify()

    def take(self, patience: float | None) -> tuple[str, dict] | None:
        """The next wish, once there is one; None if there is none for `patience` [s]."""
        with self._news:
            self._news.wait_for(lambda: self._queue, patience)
            return self._queue.popleft() if self._queue else None


class Viewer:
    """A machine on a page, served until `close`."""

    def __init__(
        self,
        platform: Platform,
        *,
        host: str = "localhost",
        port: int | None = None,
        trajectory: Trajectory | None = None,
    ) -> None:
        """Draws at once; the solver is compiled behind it.

        Raises:
            GoughError: the port is taken.
        """
        self.platform, self.trajectory = platform, trajectory
        self.model = Model(platform)
        self.server = servers.start(host, port, f"gough · {platform.name}")
        self._wishes = Wishes()
        self.scene = Scene(self.server, platform)
        self.panel = Panel(self.server, platform, self._wishes.post, trajectory)
        self._note, self._ready, self._dragging = COMPILING, False, False
        self._modes: AssemblyModes | None = None
        self._row, self._playing, self._speed = 0, False, 1.0
        self._failure: BaseException | None = None
        self._connected = threading.Event()
        self.server.on_client_connect(lambda _: self._connected.set())
        self._listen_to_handle()
        self.panel.enable(False)
        if trajectory is not None:
            self.scene.show_way(trajectory.pose)
            self._show_row({"row": 0})
        self._draw()
        self._tell()
        self._worker = self._start(self._work)
        self._start(self._prepare)

    @property
    def port(self) -> int:
        """The port it listens at."""
        return self.server.get_port()

    def wait(self) -> None:
        """Serve until a signal interrupts, or until something goes wrong, which is raised."""
        while self._failure is None:
            time.sleep(0.1)
        raise self._failure

    def close(self) -> None:
        """End the server and the threads behind it; one that compiles ends when it has done so."""
        self._playing = False
        self._wishes.post("close", {})
        self._worker.join()
        servers.stop(self.server)

    # ---- threads ----------------------------------------------------------------------

    def _start(self, work: Callable[..., None], *arguments: Any) -> threading.Thread:
        """Run something beside the rest; what it raises, `wait` raises in the main thread."""

        def run() -> None:
            try:
                work(*arguments)
            except BaseException as error:
                self._failure = error

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        return thread

    def _work(self) -> None:
        """Carry out wishes, one after the other."""
        told, stale = 0.0, False
        while True:
            wish = self._wishes.take(SPEAKING if stale else None)
            if wish is not None:
                kind, what = wish
                if kind == "close":
                    return
                getattr(self, f"_on_{kind}")(what)
                self._draw()
            # numbers that nobody can read are left out, for the picture's sake
            stale = wish is not None and time.monotonic() - told < SPEAKING
            if not stale:
                self._tell()
                told = time.monotonic()

    def _prepare(self) -> None:
        """Compile what leg sliders need, after the browser has drawn, which would be held up."""
        from gough.view.follow import follow

        self._connected.wait(PATIENCE)
        home = self.platform.home, self.platform.home_legs
        follow(self.platform, *home, home[1])
        follow(self.platform, *home, home[1] * 0 + 1e3 * self.platform.size)  # none: tries all
        self._wishes.post("ready", {})

    def _play(self) -> None:
        """Post rows as time goes by, until the last."""
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
                self._wishes.post("tick", {"row": row_of(times, now)})
        self._wishes.post("pause", {})

    def _find(self, legs: np.ndarray) -> None:
        from gough.modes.assembly import assembly_modes

        self._wishes.post("found", {"modes": assembly_modes(self.platform, legs)})

    # ---- wishes -----------------------------------------------------------------------

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

    def _on_forget(self, _: dict) -> None:
        self.model.forget()

    def _on_handle(self, what: dict) -> None:
        if self.scene.handle is not None:
            self.scene.handle.visible = what["visible"]

    def _on_find(self, _: dict) -> None:
        self.panel.modes.find.disabled = True
        self.panel.modes.clear(LOOKING)
        self._start(self._find, self.model.legs)

    def _on_found(self, what: dict) -> None:
        modes: AssemblyModes = what["modes"]
        self.panel.modes.find.disabled = False
        if not np.array_equal(modes.legs, self.model.legs):
            self.panel.modes.clear(OUTDATED)
            return
        self._modes = modes
        self.panel.modes.show(modes)
        pick = lambda index: self._wishes.post("pick", {"mode": index})  # noqa: E731
        self.scene.show_ghosts(modes.pose, modes.legs, modes.sign, pick)

    def _on_pick(self, what: dict) -> None:
        if self._modes is not None:
            index = what["mode"]
            pose, residual = self._modes.pose[index], float(self._modes.residual[index])
            self.model.pick(pose, residual, "assembly mode")

    def _on_row(self, what: dict) -> None:
        self._playing = False
        self._show_row(what)

    def _on_tick(self, what: dict) -> None:
        if self._playing:  # else paused since
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
        """Bring the picture to the model."""
        if self._modes is not None and not np.array_equal(self._modes.legs, self.model.legs):
            self._modes = None
            self.scene.clear_ghosts()
            self.panel.modes.clear(OUTDATED)
        self.scene.draw(self.model.pose, self.model.legs, handle=not self._dragging)

    def _tell(self) -> None:
        """Bring the panel to the model."""
        self.panel.modes.mark(self._shown_mode())
        with self.server.atomic():
            self.panel.show(self.model, self._note)
            if self.trajectory is not None:
                self.panel.player.show(self._row, self._playing)

    def _shown_mode(self) -> int | None:
        """Which of the modes the picture shows."""
        if self._modes is None or not len(self._modes.row):
            return None
        shift, turn = self._modes.pose.distance(self.model.pose)
        gap = shift / self.platform.size + turn
        best = int(np.argmin(gap))
        return best if gap[best] < SAME_POSE else None

    def _listen_to_handle(self) -> None:
        handle = self.scene.handle
        assert handle is not None

        @handle.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            where = {"position": np.array(handle.position), "wxyz": np.array(handle.wxyz)}
            if event.phase == "end":
                self._wishes.post("drop", {})
            elif event.phase == "update":
                self._wishes.post("drag", where)
