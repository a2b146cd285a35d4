"""Make the picture of exported machines in MuJoCo.

MUJOCO_GL=egl python tools/simulator_picture.py docs/images/mujoco.png
"""

# MuJoCo ships no types.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import sys

import mujoco
import numpy as np
from PIL import Image

from gough import Platform
from gough.export.mjcf import to_mjcf

MACHINES = ("rubin_camera", "reference", "reachy_mini")
HEIGHT, WIDTH = 360, 400  # [pixels] of each machine


def main(path: str) -> None:
    """Write the machines at home, side by side, into one file."""
    images = [_image(Platform.load(name)) for name in MACHINES]
    Image.fromarray(np.concatenate(images, axis=1)).save(path, optimize=True)


def _image(platform: Platform) -> np.ndarray:
    model = mujoco.MjModel.from_xml_string(to_mjcf(platform))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    mujoco.mjv_defaultFreeCamera(model, camera)
    camera.elevation = -20
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        renderer.update_scene(data, camera)
        return renderer.render()


if __name__ == "__main__":
    main(sys.argv[1])
