"""What stands around in the scene, as the scenario has it: floor, board, table, box, obstacles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from deploy.robot import robot_kind
from services.console.robot_view import upright
from services.messages import ObjectEstimate, Truth
from sim.obstacle_specs import Box, Mover, Wall
from sim.obstacles import Obstacles
from sim.scenario import Scenario

Array = NDArray[np.float64]

WOOD, STONE, PERSON = (190, 160, 120), (150, 155, 165), (214, 137, 16)
CARTON, BELIEVED = (196, 140, 80), (33, 110, 230)
THICKNESS = 0.04  # of a table's top [m]


class Surroundings:
    """Everything that is not the robot.

    Args:
        scene: of viser.
        scenario: whose world is drawn.

    Attributes:
        board: rotation R_WS and position p_WS of the board, None if the robot has no pen.
    """

    def __init__(self, scene: Any, scenario: Scenario) -> None:
        self._scenario, world = scenario, scenario.world
        scene.add_grid("/floor", width=20, height=20, cell_size=0.5, section_size=1.0)
        self.board: tuple[Array, Array] | None = None
        self._box = self._believed = None
        if robot_kind(scenario.robot) == "two_arm":
            table = world.table
            scene.add_box(
                "/table",
                color=WOOD,
                dimensions=(*table.size, THICKNESS),
                wxyz=upright(table.yaw),
                position=(table.x, table.y, table.height - THICKNESS / 2),
            )
            if world.box is not None:
                size = world.box.size
                self._box = scene.add_box("/box", color=CARTON, dimensions=size, visible=False)
                self._believed = scene.add_box(
                    "/box_believed",
                    color=BELIEVED,
                    dimensions=tuple(1.01 * edge for edge in size),
                    opacity=0.3,
                    visible=False,
                )
        else:
            self.board = (world.board.rotation(), world.board.position())
            self._add_board(scene)
        self._obstacles = Obstacles(world.obstacle)
        self._movers = self._add_obstacles(scene)

    def _add_board(self, scene: Any) -> None:
        assert self.board is not None
        R, p = self.board
        scene.add_frame(
            "/board",
            show_axes=False,
            wxyz=Rotation.from_matrix(R).as_quat(scalar_first=True),
            position=p,
        )
        board = self._scenario.world.board
        size = (board.width, board.height, 0.02)
        scene.add_box(
            "/board/plate", color=(250, 250, 250), dimensions=size, position=(0, 0, -0.011)
        )
        frame = (board.width + 0.04, board.height + 0.04, 0.02)
        scene.add_box(
            "/board/frame", color=(120, 125, 135), dimensions=frame, position=(0, 0, -0.018)
        )

    def _add_obstacles(self, scene: Any) -> list[Any]:
        movers = []
        for number, spec in enumerate(self._scenario.world.obstacle):
            name = f"/obstacles/{number}"
            solid = spec.box() if isinstance(spec, Wall) else spec
            if isinstance(solid, Box):
                scene.add_box(
                    name,
                    color=STONE,
                    opacity=0.6,
                    dimensions=(solid.length, solid.width, spec.height),
                    wxyz=upright(solid.yaw),
                    position=(solid.x, solid.y, spec.height / 2),
                )
                continue
            x, y = solid.points[0] if isinstance(solid, Mover) else (solid.x, solid.y)
            handle = scene.add_cylinder(
                name,
                radius=solid.radius,
                height=solid.height,
                color=PERSON if isinstance(solid, Mover) else STONE,
                opacity=0.6,
                position=(x, y, solid.height / 2),
            )
            if isinstance(solid, Mover):
                movers.append(handle)
        return movers

    def show(
        self, t: float, truth: Truth | None, seen: ObjectEstimate | None, offset: Array
    ) -> None:
        """Put what moves where it is.

        Args:
            t: robot time [s].
            truth: newest.
            seen: what is believed of the box, in O.
            offset: X_WO as x, y, heading, shape (3,).
        """
        if self._movers:
            # the last circles are the movers, in the scenario's order
            circles = self._obstacles.at(t).circles[-len(self._movers) :]
            for handle, (x, y, *_) in zip(self._movers, circles, strict=True):
                handle.position = (x, y, handle.height / 2)
        if self._box is None or self._believed is None:
            return
        pose = truth.bodies.get("box") if truth is not None else None
        self._box.visible = pose is not None
        if pose is not None:
            self._box.position, self._box.wxyz = pose[:3], pose[3:]
        self._believed.visible = seen is not None
        if seen is not None:
            turn = Rotation.from_euler("z", offset[2])
            self._believed.position = turn.apply(seen.p) + (offset[0], offset[1], 0.0)
            rotation = turn * Rotation.from_matrix(seen.R)
            self._believed.wxyz = rotation.as_quat(scalar_first=True)
