"""The picture: base, plate and legs of one machine, its other modes as ghosts, its way."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gough.checks import Array
from gough.kinematics import joint_positions
from gough.platform import Platform
from gough.pose import Pose
from gough.view import colors
from gough.view import meshes as shapes

if TYPE_CHECKING:
    import viser

# radii and thicknesses, as shares of the platform's size
JOINT, THICK, THIN, PLATE = 0.017, 0.014, 0.0075, 0.014
LOOK_FROM = np.array([1.05, -1.75, 0.95])  # where the camera is, seen from the middle
BESIDE = 0.26  # how far the picture is moved for the panel
GRID = 3.0  # width of the ground's grid
FAINT = 0.08, 0.35, 4.0  # ghosts' opacity: least, most, and how much all have together
DEEPER = 0.6  # what light from two sides adds to them is taken off first


class Scene:
    """Draws a machine into a viser scene; `draw` moves it, and sends only what has changed.

    Attributes:
        handle: the transform controls on the plate, or None in a page that nobody answers.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        platform: Platform,
        *,
        handle: bool = True,
        panel: bool = True,
    ) -> None:
        """Draws the machine at home.

        Args:
            handle: put a handle on the plate.
            panel: there is a panel on the right, beside which the machine is to stand.
        """
        self._server, self.platform = server, platform
        self.frame = shapes.Frame.of(platform)
        self._hub = platform.moving.mean(axis=0)  # of the plate, in platform coordinates
        self._ghosts: list = []
        with server.atomic():
            self._set_lights()
            self._set_camera(panel)
            self._add_ground()
            self._add_base()
            self._add_plate()
            self._add_legs()
            self.handle = self._add_handle() if handle else None
        self.draw(platform.home, platform.home_legs)

    # ---- what moves -------------------------------------------------------------------

    def draw(self, pose: Pose, legs: Array, *, handle: bool = True) -> None:
        """Show the machine at a pose with its readings (6,).

        Args:
            handle: bring the handle to the plate; not while someone drags it.
        """
        parts = shapes.Limbs(
            *(self.frame.drawn(p) for p in shapes.limbs(self.platform, pose, legs))
        )
        paint = colors.leg_colors(self.platform, legs)
        place = self._place_of(pose)
        with self._server.atomic():
            self._plate.position, self._plate.wxyz = place, pose.wxyz
            if handle and self.handle is not None:
                self.handle.position, self.handle.wxyz = place, pose.wxyz
            rods = (
                (self._thick, parts.thick_start, parts.thick_end, THICK),
                (self._thin, parts.thin_start, parts.thin_end, THIN),
            )
            for node, start, end, radius in rods:
                position, wxyz, scale = shapes.rods_between(start, end, radius)
                node.batched_positions, node.batched_wxyzs = _single(position), _single(wxyz)
                node.batched_scales = _single(scale)
            self._thick.batched_colors = paint
            if self._elbows is not None:
                self._elbows.batched_positions = _single(parts.thin_start)
            self._mark_out_of_stroke(legs)

    def pose_of_handle(self, position: Array, wxyz: Array) -> Pose:
        """The pose at which the plate would be where the handle is."""
        turned = Pose(np.zeros(3), wxyz)
        pivot = self.platform.pivot_point
        reach = turned.apply(self._hub - pivot)
        return Pose(self.frame.told(np.asarray(position)) - pivot - reach, wxyz)

    def _place_of(self, pose: Pose) -> Array:
        pivot = self.platform.pivot_point
        turned = pose.rotation @ (self._hub - pivot)
        return self.frame.drawn(turned + pivot + pose.position)

    def _mark_out_of_stroke(self, legs: Array) -> None:
        for i, out in enumerate(colors.out_of_stroke(self.platform, legs)):
            self._labels[i].text = f"{i + 1} out of stroke" if out else f"{i + 1}"

    # ---- other modes and the way ------------------------------------------------------

    def show_ghosts(
        self, pose: Pose, legs: Array, sign: Array, pick: Callable[[int], None] | None
    ) -> None:
        """Faint machines at poses (M,) that have the readings (6,) too.

        Args:
            sign: (M,) of det J against home's, which gives the colour.
            pick: called with the number of a ghost that is clicked.
        """
        self.clear_ghosts()
        if not len(pose):
            return
        mesh = shapes.plate((self.platform.moving - self._hub) / self.frame.size, PLATE / 2)
        same = np.asarray(sign)[:, None] > 0
        least, most, together = FAINT
        opacity = min(max(together / len(pose), least), most)
        paint = np.where(same, colors.rgb(colors.SAME), colors.rgb(colors.OTHER))
        paint = (DEEPER * paint).astype(np.uint8)
        places = np.stack([self._place_of(pose[i]) for i in range(len(pose))])
        with self._server.atomic():
            plates = self._server.scene.add_batched_meshes_simple(
                "/ghosts/plates", mesh.vertices, mesh.faces, pose.wxyz, places,
                batched_colors=paint, opacity=opacity, side="double",
                flat_shading=True, cast_shadow=False, receive_shadow=False, lod="off",
            )  # fmt: skip
            joints = self.frame.drawn(joint_positions(self.platform, pose))
            starts = self.frame.drawn(shapes.limbs(self.platform, pose[0], legs).thin_start)
            lines = np.stack([np.broadcast_to(starts, joints.shape), joints], axis=2)
            tint = np.repeat((paint * 0.45 + 255 * 0.55).astype(np.uint8), 12, axis=0)
            rods = self._server.scene.add_line_segments(
                "/ghosts/rods", lines.reshape(-1, 2, 3), tint.reshape(-1, 2, 3),
                thickness=1.2, thickness_units="screen",
            )  # fmt: skip
        self._ghosts = [plates, rods]
        if pick is not None:

            @plates.on_click
            def _(event: viser.SceneNodePointerEvent) -> None:
                if event.instance_index is not None:
                    pick(event.instance_index)

    def clear_ghosts(self) -> None:
        """Take the ghosts away."""
        for node in self._ghosts:
            node.remove()
        self._ghosts = []

    def show_way(self, pose: Pose) -> None:
        """The way of the plate's centre through poses (N,), N above 1."""
        points = joint_positions(self.platform, pose).mean(axis=-2)
        points = self.frame.drawn(points[np.all(np.isfinite(points), axis=-1)])
        if len(points) > 1:
            self._server.scene.add_line_segments(
                "/way", np.stack([points[:-1], points[1:]], axis=1), colors.rgb(colors.ORANGE),
                thickness=2.0, thickness_units="screen",
            )  # fmt: skip

    # ---- what stays -------------------------------------------------------------------

    def _all_joints(self) -> Array:
        home = joint_positions(self.platform, self.platform.home)
        return self.frame.drawn(np.concatenate([self.platform.base, home]))

    def _set_camera(self, panel: bool) -> None:
        joints = self._all_joints()
        middle = (joints.min(axis=0) + joints.max(axis=0)) / 2
        if panel:
            right = np.cross([0.0, 0.0, 1.0], LOOK_FROM)
            middle = middle + BESIDE * right / np.linalg.norm(right)
        camera = self._server.initial_camera
        camera.position, camera.look_at = middle + LOOK_FROM, middle
        camera.up, camera.fov = np.array([0.0, 0.0, 1.0]), 0.7
        camera.near, camera.far = 0.01, 100.0
        self._server.scene.set_up_direction("+z")

    def _set_lights(self) -> None:
        """Neutral light, in which colours are what the legend says, and no costly shadows."""
        self._server.scene.configure_environment_map(hdri=None)
        self._server.scene.add_light_ambient("/light", intensity=1.0)
        self._server.scene.configure_default_lights(cast_shadow=False)

    def _add_ground(self) -> None:
        """A grid of round numbers, below everything."""
        low = self._all_joints()[:, 2].min() - 3 * JOINT
        self.cell = shapes.round_number(0.1 * self.frame.size)
        cell = self.cell / self.frame.size
        self._server.scene.add_grid(
            "/ground", GRID, GRID, position=(0.0, 0.0, low), cell_size=cell,
            section_size=5 * cell, cell_color=colors.rgb(colors.GROUND), cell_thickness=0.6,
            section_color=colors.rgb(colors.GROUND_FIFTH), section_thickness=0.9,
            fade_distance=6.0, fade_strength=2.0, fade_from="origin", shadow_opacity=0.0,
        )  # fmt: skip

    def _add_base(self) -> None:
        base = self.frame.drawn(self.platform.base)
        self._add_slab("/base", base, colors.BASE)
        self._add_balls("/base/joints", base, colors.GREY, 1.2 * JOINT)
        if self.platform.rotary is not None:
            axis = np.cross(self.platform.rotary.axis_x, self.platform.rotary.axis_y)
            ends = base - 0.03 * axis, base + 0.03 * axis
            self._add_rods("/base/motors", *ends, colors.GREY, 2.2 * THICK)
        places = shapes.label_places(base)
        self._labels = [
            self._server.scene.add_label(
                f"/labels/{i + 1}", f"{i + 1}", position=place, anchor="center-center",
                font_screen_scale=0.9,
            )
            for i, place in enumerate(places)
        ]  # fmt: skip
        self._add_axes("/base/origin", np.zeros(3), 0.12)

    def _add_axes(self, name: str, origin: Array, length: float) -> None:
        """The axes of base coordinates, if their origin is within sight."""
        place = self.frame.drawn(origin)
        if np.linalg.norm(place) < 1.0:
            self._server.scene.add_frame(
                name, axes_length=length, axes_radius=0.003, origin_radius=0.006, position=place
            )

    def _add_plate(self) -> None:
        moving = (self.platform.moving - self._hub) / self.frame.size
        self._plate = self._server.scene.add_frame(
            "/plate", axes_length=0.1, axes_radius=0.003, origin_radius=0.006
        )
        self._add_slab("/plate/slab", moving, colors.PLATE)
        self._add_balls("/plate/joints", moving, colors.GREY, JOINT)

    def _add_legs(self) -> None:
        nowhere = np.zeros((6, 3)), np.tile([0.0, 0.0, 1.0], (6, 1))
        self._thick = self._add_rods("/legs/thick", *nowhere, colors.GREY, THICK)
        self._thin = self._add_rods("/legs/thin", *nowhere, "#C9CED3", THIN)
        rotary = self.platform.rotary is not None
        self._elbows = (
            self._add_balls("/legs/elbows", nowhere[0], colors.GREY, JOINT) if rotary else None
        )

    def _add_handle(self) -> viser.TransformControlsHandle:
        return self._server.scene.add_transform_controls(
            "/handle", scale=0.28, line_width=2.5, depth_test=False, opacity=0.85,
            disable_sliders=True,
        )  # fmt: skip

    # ---- parts ------------------------------------------------------------------------

    def _add_slab(self, name: str, joints: Array, color: str) -> None:
        mesh = shapes.plate(joints, PLATE)
        self._server.scene.add_mesh_simple(
            name, mesh.vertices, mesh.faces, color=colors.rgb(color), flat_shading=True,
        )  # fmt: skip

    def _add_balls(
        self, name: str, centres: Array, color: str, radius: float
    ) -> viser.BatchedMeshHandle:
        mesh = shapes.sphere()
        return self._server.scene.add_batched_meshes_simple(
            name, mesh.vertices, mesh.faces, np.tile([1.0, 0.0, 0.0, 0.0], (6, 1)), centres,
            batched_scales=np.full(6, radius), batched_colors=colors.rgb(color), lod="off",
            cast_shadow=False,
        )  # fmt: skip

    def _add_rods(
        self, name: str, starts: Array, ends: Array, color: str, radius: float
    ) -> viser.BatchedMeshHandle:
        mesh = shapes.cylinder()
        position, wxyz, scale = shapes.rods_between(starts, ends, radius)
        return self._server.scene.add_batched_meshes_simple(
            name, mesh.vertices, mesh.faces, wxyz, position, batched_scales=scale,
            batched_colors=np.tile(np.array(colors.rgb(color), np.uint8), (6, 1)), lod="off",
        )  # fmt: skip


def _single(values: Array) -> NDArray[np.float32]:
    return np.asarray(values, np.float32)
