"""The picture: base, plate and legs of one machine, its other modes, and the path of a file."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.frames import FramePose
from gough.kinematics import joint_positions
from gough.platform import Platform
from gough.pose import Pose
from gough.view import meshes
from gough.view.beyond import Beyond, beyond_limits
from gough.view.ghosts import draw_modes

if TYPE_CHECKING:
    import viser

# radius and thickness / size of the platform
JOINT, PLATE = 0.017, 0.014
VIEWS = {  # position of the camera, from the middle of the machine, and its upward direction
    "3-D": ((1.05, -1.75, 0.95), (0.0, 0.0, 1.0)),
    "Front": ((0.0, -2.25, 0.0), (0.0, 0.0, 1.0)),
    "Right": ((2.25, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "Top": ((0.0, 0.0, 2.25), (0.0, 1.0, 0.0)),
}
BESIDE = 0.26  # translation of the picture to the left, for the panel / size
GRID = 3.0  # width of the ground's grid / size
GROUND, GROUND_FIFTH = "#DDE1E5", "#B9C0C7"  # lines of the grid
FARTHEST = 2.0  # distance of a frame from the base's centre, beyond which it is not drawn / size


class Scene:
    """One machine in a viser scene; `draw` moves it, and sends only what has changed.

    Attributes:
        handle: the transform controls on the plate, or None in an exported page.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        platform: Platform,
        view: FramePose | None = None,
        *,
        handle: bool = True,
        panel: bool = True,
    ) -> None:
        """Draw the machine at home.

        Args:
            view: a frame whose axes, and those of the frame at rest, are drawn.
            handle: put a handle on the plate.
            panel: leave space for a panel on the right.
        """
        self._server, self.platform, self._panel = server, platform, panel
        self.frame = meshes.Frame.of(platform)
        self._hub = platform.moving.mean(axis=0)  # of the plate, in platform coordinates
        self._thick_radius, self._thin_radius = meshes.leg_radii(platform)
        self._modes: list = []
        with server.atomic():
            self._set_lights()
            self._set_camera()
            self._add_ground()
            self._add_base()
            self._add_plate()
            self._add_legs()
            if view is not None:
                self._add_frames(view)
            self.handle = self._add_handle() if handle else None
        self.draw(platform.home, platform.home_legs)

    # ---- moving parts ----------------------------------------------------------------

    def draw(
        self, pose: Pose, legs: Array, *, beyond: Beyond | None = None, handle: bool = True
    ) -> None:
        """Show the machine at a pose with its readings (6,); red where it exceeds its limits.

        Args:
            beyond: these limits, where they are known.
            handle: move the handle, too; not while someone drags it.
        """
        parts = meshes.Limbs(
            *(self.frame.drawn(p) for p in meshes.limbs(self.platform, pose, legs))
        )
        beyond = beyond or beyond_limits(self.platform, pose, legs)
        paint = meshes.leg_colors(self.platform, legs)
        paint[beyond.legs] = meshes.rgb(meshes.OUT)
        place = self._plate_centre(pose)
        with self._server.atomic():
            self._plate.position, self._plate.wxyz = place, pose.wxyz
            if handle and self.handle is not None:
                self.handle.position, self.handle.wxyz = place, pose.wxyz
            rods = (
                (self._thick, parts.thick_start, parts.thick_end, self._thick_radius),
                (self._thin, parts.thin_start, parts.thin_end, self._thin_radius),
            )
            for node, start, end, radius in rods:
                position, wxyz, scale = meshes.rods_between(start, end, radius)
                node.batched_positions, node.batched_wxyzs = _single(position), _single(wxyz)
                node.batched_scales = _single(scale)
            self._thick.batched_colors = paint
            if self._elbows is not None:
                self._elbows.batched_positions = _single(parts.thin_start)
            for balls, bent in zip(
                self._balls, (beyond.base_joint, beyond.moving_joint), strict=True
            ):
                balls.batched_colors = np.where(
                    bent[:, None], meshes.rgb(meshes.OUT), meshes.rgb(meshes.GREY)
                ).astype(np.uint8)
            for i, label in enumerate(self._labels):
                label.text = f"{i + 1} {beyond.label(i)}".rstrip()

    def pose_of_handle(self, position: Array, wxyz: Array) -> Pose:
        """Pose at which the plate is where the handle is."""
        rotated = Pose(np.zeros(3), wxyz)
        pivot = self.platform.pivot_point
        hub = rotated.apply(self._hub - pivot)
        return Pose(self.frame.from_drawn(np.asarray(position)) - pivot - hub, wxyz)

    def _plate_centre(self, pose: Pose) -> Array:
        pivot = self.platform.pivot_point
        rotated = pose.rotation @ (self._hub - pivot)
        return self.frame.drawn(rotated + pivot + pose.position)

    # ---- other modes and the path -----------------------------------------------------

    def show_modes(
        self, pose: Pose, legs: Array, sign: Array, pick: Callable[[int], None] | None
    ) -> None:
        """Draw faint machines at poses (M,) with the same readings (6,); see `draw_modes`."""
        self.clear_modes()
        if len(pose):
            places = np.stack([self._plate_centre(pose[i]) for i in range(len(pose))])
            self._modes = draw_modes(
                self._server, self.platform, self.frame, pose, legs, sign, places, pick
            )

    def clear_modes(self) -> None:
        """Remove the faint machines."""
        for node in self._modes:
            node.remove()
        self._modes = []

    def show_path(self, pose: Pose) -> None:
        """Draw the path of the plate's centre through poses (N,)."""
        points = joint_positions(self.platform, pose).mean(axis=-2)
        points = self.frame.drawn(points[np.all(np.isfinite(points), axis=-1)])
        if len(points) > 1:
            self._server.scene.add_line_segments(
                "/path", np.stack([points[:-1], points[1:]], axis=1), meshes.rgb(meshes.ORANGE),
                thickness=2.0, thickness_units="screen",
            )  # fmt: skip

    # ---- fixed parts -----------------------------------------------------------------

    def _all_joints(self) -> Array:
        home = joint_positions(self.platform, self.platform.home)
        return self.frame.drawn(np.concatenate([self.platform.base, home]))

    def camera(self, view: str) -> tuple[Array, Array, Array]:
        """Position, point looked at, and upward direction of the camera for one of `VIEWS`."""
        joints = self._all_joints()
        middle = (joints.min(axis=0) + joints.max(axis=0)) / 2
        offset, up = (np.array(vector) for vector in VIEWS[view])
        if self._panel:
            right = np.cross(up, offset)
            middle = middle + BESIDE * right / np.linalg.norm(right)
        return middle + offset, middle, up

    def _set_camera(self) -> None:
        camera = self._server.initial_camera
        camera.position, camera.look_at, camera.up = self.camera("3-D")
        camera.fov, camera.near, camera.far = 0.7, 0.01, 100.0
        self._server.scene.set_up_direction("+z")

    def _set_lights(self) -> None:
        """Set neutral light, so that colours agree with the legend, and no costly shadows."""
        self._server.scene.configure_environment_map(hdri=None)
        self._server.scene.add_light_ambient("/light", intensity=1.0)
        self._server.scene.configure_default_lights(cast_shadow=False)

    def _add_ground(self) -> None:
        """Draw a grid with cells of round size below everything."""
        low = self._all_joints()[:, 2].min() - 3 * JOINT
        self.cell = meshes.round_number(0.1 * self.frame.size)
        cell = self.cell / self.frame.size
        self._server.scene.add_grid(
            "/ground", GRID, GRID, position=(0.0, 0.0, low), cell_size=cell,
            section_size=5 * cell, cell_color=meshes.rgb(GROUND), cell_thickness=0.6,
            section_color=meshes.rgb(GROUND_FIFTH), section_thickness=0.9,
            fade_distance=6.0, fade_strength=2.0, fade_from="origin", shadow_opacity=0.0,
        )  # fmt: skip

    def _add_base(self) -> None:
        base = self.frame.drawn(self.platform.base)
        self._add_slab("/base", base, meshes.BASE)
        self._balls = [self._add_balls("/base/joints", base, meshes.GREY, 1.2 * JOINT)]
        if self.platform.rotary is not None:
            axis = np.cross(self.platform.rotary.axis_x, self.platform.rotary.axis_y)
            ends = base - 0.03 * axis, base + 0.03 * axis
            self._add_rods("/base/motors", *ends, meshes.GREY, 2.2 * meshes.THICK)
        places = meshes.label_places(base)
        self._labels = [
            self._server.scene.add_label(
                f"/labels/{i + 1}", f"{i + 1}", position=place, anchor="center-center",
                font_screen_scale=0.9,
            )
            for i, place in enumerate(places)
        ]  # fmt: skip
        self._add_axes("/base/origin", np.zeros(3), 0.12)

    def _add_axes(self, name: str, origin: Array, length: float) -> None:
        """Draw the axes of base coordinates, if their origin is in view."""
        place = self.frame.drawn(origin)
        if np.linalg.norm(place) < 1.0:
            self._server.scene.add_frame(
                name, axes_length=length, axes_radius=0.003, origin_radius=0.006, position=place
            )

    def _add_frames(self, view: FramePose) -> None:
        """Draw and name the axes of a moving frame and of one at rest, if they are in view."""
        moving, at_rest = view.name.split(" in ")
        origin = (view.after.position - self._hub) / self.frame.size
        rest = view.before.inverse()
        for parent, name, place, wxyz in (
            ("/plate", moving, origin, view.after.wxyz),
            ("", at_rest, self.frame.drawn(rest.position), rest.wxyz),
        ):
            if np.linalg.norm(place) < FARTHEST:
                node = f"{parent}/frame_{name}"
                self._server.scene.add_frame(
                    node, axes_length=0.12, axes_radius=0.004, origin_radius=0.008,
                    position=place, wxyz=wxyz,
                )  # fmt: skip
                self._server.scene.add_label(
                    f"{node}/name", name, position=(0.0, 0.0, 0.15), anchor="center-center",
                    font_screen_scale=0.9,
                )  # fmt: skip

    def _add_plate(self) -> None:
        moving = (self.platform.moving - self._hub) / self.frame.size
        self._plate = self._server.scene.add_frame(
            "/plate", axes_length=0.1, axes_radius=0.003, origin_radius=0.006
        )
        self._add_slab("/plate/slab", moving, meshes.PLATE)
        self._balls.append(self._add_balls("/plate/joints", moving, meshes.GREY, JOINT))

    def _add_legs(self) -> None:
        nowhere = np.zeros((6, 3)), np.tile([0.0, 0.0, 1.0], (6, 1))
        self._thick = self._add_rods("/legs/thick", *nowhere, meshes.GREY, meshes.THICK)
        self._thin = self._add_rods("/legs/thin", *nowhere, "#C9CED3", meshes.THIN)
        rotary = self.platform.rotary is not None
        self._elbows = (
            self._add_balls("/legs/elbows", nowhere[0], meshes.GREY, JOINT) if rotary else None
        )

    def _add_handle(self) -> viser.TransformControlsHandle:
        return self._server.scene.add_transform_controls(
            "/handle", scale=0.28, line_width=2.5, depth_test=False, opacity=0.85,
            disable_sliders=True,
        )  # fmt: skip

    # ---- parts ------------------------------------------------------------------------

    def _add_slab(self, name: str, joints: Array, color: str) -> None:
        mesh = meshes.plate(joints, PLATE)
        self._server.scene.add_mesh_simple(
            name, mesh.vertices, mesh.faces, color=meshes.rgb(color), flat_shading=True,
        )  # fmt: skip

    def _add_balls(
        self, name: str, centres: Array, color: str, radius: float
    ) -> viser.BatchedMeshHandle:
        mesh = meshes.sphere()
        return self._server.scene.add_batched_meshes_simple(
            name, mesh.vertices, mesh.faces, np.tile([1.0, 0.0, 0.0, 0.0], (6, 1)), centres,
            batched_scales=np.full(6, radius), batched_colors=meshes.rgb(color), lod="off",
            cast_shadow=False,
        )  # fmt: skip

    def _add_rods(
        self, name: str, starts: Array, ends: Array, color: str, radius: float
    ) -> viser.BatchedMeshHandle:
        mesh = meshes.cylinder()
        position, wxyz, scale = meshes.rods_between(starts, ends, radius)
        return self._server.scene.add_batched_meshes_simple(
            name, mesh.vertices, mesh.faces, wxyz, position, batched_scales=scale,
            batched_colors=np.tile(np.array(meshes.rgb(color), np.uint8), (6, 1)), lod="off",
        )  # fmt: skip


def _single(values: Array) -> NDArray[np.float32]:
    return np.asarray(values, np.float32)
