"""Other assembly modes in the picture: faint machines with the same readings."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from gough.checks import Array
from gough.kinematics import joint_positions
from gough.platform import Platform
from gough.pose import Pose
from gough.view import meshes

if TYPE_CHECKING:
    import viser

# opacity: least, most, and the sum over all
FAINT = 0.08, 0.35, 4.0
DARKER = 0.6  # factor of their colours, since light from both sides brightens them
THIN_PLATE = 0.007  # thickness of a plate / size


def draw_modes(
    server: viser.ViserServer,
    platform: Platform,
    frame: meshes.Frame,
    pose: Pose,
    legs: Array,
    sign: Array,
    places: Array,
    pick: Callable[[int], None] | None,
) -> list[Any]:
    """Draw faint machines at poses (M,) with the same readings (6,); returns their nodes.

    Args:
        sign: (M,) of det J relative to home's, which gives the colour.
        places: (M, 3) of the plates, drawn.
        pick: called with the index of a plate that is clicked.
    """
    hub = platform.moving.mean(axis=0)
    mesh = meshes.plate((platform.moving - hub) / frame.size, THIN_PLATE)
    same = np.asarray(sign)[:, None] > 0
    least, most, together = FAINT
    opacity = min(max(together / len(pose), least), most)
    paint = np.where(same, meshes.rgb(meshes.SAME), meshes.rgb(meshes.OTHER))
    paint = (DARKER * paint).astype(np.uint8)
    with server.atomic():
        plates = server.scene.add_batched_meshes_simple(
            "/modes/plates", mesh.vertices, mesh.faces, pose.wxyz, places,
            batched_colors=paint, opacity=opacity, side="double",
            flat_shading=True, cast_shadow=False, receive_shadow=False, lod="off",
        )  # fmt: skip
        joints = frame.drawn(joint_positions(platform, pose))
        starts = frame.drawn(meshes.limbs(platform, pose[0], legs).thin_start)
        lines = np.stack([np.broadcast_to(starts, joints.shape), joints], axis=2)
        tint = np.repeat((paint * 0.45 + 255 * 0.55).astype(np.uint8), 12, axis=0)
        rods = server.scene.add_line_segments(
            "/modes/rods", lines.reshape(-1, 2, 3), tint.reshape(-1, 2, 3),
            thickness=1.2, thickness_units="screen",
        )  # fmt: skip
    if pick is not None:

        @plates.on_click
        def _(event: viser.SceneNodePointerEvent) -> None:
            if event.instance_index is not None:
                pick(event.instance_index)

    return [plates, rods]
