"""The robot in the scene, and its platform's ghosts: where it is and where it is believed to be."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from services.console.model import Model, Shape

Array = NDArray[np.float64]
RGB = tuple[int, int, int]

GREEN, BLUE = (46, 160, 67), (33, 110, 230)
"""Of what is true, and of what is believed, wherever the page shows both."""
PLATFORM, ARM, DARK = (90, 98, 110), (222, 226, 230), (52, 58, 64)


class RobotView:
    """The robot's shapes as nodes of the scene.

    Args:
        scene: of viser.
        model: of the robot.
    """

    def __init__(self, scene: Any, model: Model) -> None:
        self._model = model
        self._frames = {
            body: scene.add_frame(f"/robot/{body}", show_axes=False) for body in model.bodies
        }
        for number, shape in enumerate(model.shapes):
            add_shape(scene, f"/robot/{shape.body}/{number}", shape, _colour(shape.body))
        self.ghosts = {
            "true": _Ghost(scene, "/ghosts/true", model, GREEN, 1.02),
            "estimated": _Ghost(scene, "/ghosts/estimated", model, BLUE, 1.04),
        }

    def show(self, pose: Array, q: Array) -> None:
        """Put the robot's platform at ``pose`` (x, y, heading) with joint positions ``q``."""
        for body, (wxyz, p) in self._model.place(pose, q).items():
            frame = self._frames[body]
            frame.wxyz, frame.position = wxyz, p


class _Ghost:
    """The platform alone, to be seen through."""

    def __init__(self, scene: Any, name: str, model: Model, colour: RGB, scale: float) -> None:
        self._frame = scene.add_frame(name, show_axes=True, axes_length=0.5, axes_radius=0.008)
        # a platform stands upright in the plane: its body's frame is the pose itself
        for number, shape in enumerate(s for s in model.shapes if s.body == "platform"):
            add_shape(scene, f"{name}/{number}", shape, colour, opacity=0.2, scale=scale)

    def show(self, pose: Array | None) -> None:
        """Put it at a pose (x, y, heading), or hide it."""
        self._frame.visible = pose is not None
        if pose is not None:
            self._frame.wxyz, self._frame.position = upright(pose[2]), (pose[0], pose[1], 0.0)


def upright(heading: float) -> Array:
    """Quaternion w, x, y, z of a turn about the vertical [rad]."""
    return np.array([np.cos(heading / 2), 0.0, 0.0, np.sin(heading / 2)])


def add_shape(
    scene: Any, name: str, shape: Shape, colour: RGB, opacity: float | None = None, scale: float = 1
) -> Any:
    """Add a shape to the scene below the node in its name; returns its handle."""
    wxyz, p = shape.pose
    common = {
        "color": colour,
        "opacity": opacity,
        "scale": scale,
        "wxyz": wxyz,
        "position": p,
        "cast_shadow": False,
        "receive_shadow": False,
    }
    if shape.kind == "box":
        return scene.add_box(name, dimensions=shape.size, **common)
    if shape.kind == "sphere":
        return scene.add_icosphere(name, radius=shape.size[0], subdivisions=2, **common)
    radius, length = shape.size
    return scene.add_cylinder(name, radius=radius, height=length, radial_segments=24, **common)


def _colour(body: str) -> RGB:
    if body == "platform":
        return PLATFORM
    return DARK if "palm" in body or "pen" in body else ARM
