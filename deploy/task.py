"""What the controllers are told to do: the ``[task]`` table of a scenario.

Believed quantities only. The truth of the simulated world (``sim/scenario.py``) is not among
them; arm and base are given a ``Task`` and the robot's description, and nothing else.
"""

from __future__ import annotations

import difflib
import math
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, model_validator

from deploy.numbers import NonNegative, Positive, Vector3
from deploy.tomlfile import BadFile, Strict

__all__ = [
    "BASE_PROGRAMS",
    "PROGRAMS",
    "BaseTask",
    "BoardPose",
    "BottleTask",
    "BoxTask",
    "CirclePath",
    "PathSpec",
    "PolylinePath",
    "SwayPath",
    "Task",
    "find_program",
]

PROGRAMS = Path(__file__).parent.parent / "arm" / "programs"
BASE_PROGRAMS = Path(__file__).parent.parent / "base" / "programs"

Metres = Annotated[float, Field(ge=-100, le=100)]
Angle = Annotated[float, Field(ge=-2 * math.pi, le=2 * math.pi)]
Pose2 = tuple[Metres, Metres, Angle]


class Documented(Strict):
    """A strict table whose attribute docstrings are its help text."""

    model_config = ConfigDict(use_attribute_docstrings=True)


class BoardPose(Documented):
    """Pose of the board's frame S in the ground frame (X_OS believed, X_WS true).

    S sits at the centre of the drawing area; for somebody standing in front of it x_S points
    right and y_S up, so z_S points out of the board at the robot.
    """

    x: Metres = 0.68
    """[m]"""
    y: Metres = 0.0
    """[m]"""
    z: Metres = 1.30
    """Height above the floor [m]."""
    yaw: Angle = 0.0
    """Turn about the vertical [rad]; 0 faces a platform at the origin (z_S = -x of the ground)."""

    def rotation(self) -> NDArray[np.float64]:
        """R_OS, shape (3, 3): the columns are x_S, y_S, z_S in the ground frame."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[s, 0.0, -c], [-c, 0.0, -s], [0.0, 1.0, 0.0]])

    def position(self) -> NDArray[np.float64]:
        """p_OS [m], shape (3,): the origin of S in the ground frame."""
        return np.array([self.x, self.y, self.z])


class SwayPath(Documented):
    """Sinusoids about the start pose, one a direction: x = A sin(w t)."""

    kind: Literal["sway"]
    amplitude: tuple[NonNegative, NonNegative]
    """Along x and y of the platform at its start [m]."""
    yaw_deg: Annotated[float, Field(ge=0, le=180)] = 0.0
    """Amplitude of the heading [deg]."""
    frequency: Vector3 = (1.3, 1.0, 0.8)
    """Angular frequency of x, y, heading [rad/s]."""


class CirclePath(Documented):
    """A circle to the left of the start pose, run counter-clockwise."""

    kind: Literal["circle"]
    radius: Positive
    """[m]"""
    speed: Positive
    """Along the circle [m/s]."""
    heading: Literal["fixed", "tangent"] = "fixed"
    """Keep the heading of the start, or turn with the circle."""
    loop: bool = True
    """Go round for ever, or stop after one turn."""


class PolylinePath(Documented):
    """Straight legs from the start pose through ``points``, blended smoothly at the corners."""

    kind: Literal["line", "polyline"]
    points: Annotated[tuple[Pose2, ...], Field(min_length=1)]
    """x, y [m], heading [rad] relative to the start pose, which is the implied first point."""
    speed: Positive
    """Along a leg [m/s]."""
    turn_rate: Positive = 0.3
    """Fastest turn of the heading [rad/s]; a leg that turns further than it drives takes longer."""
    acceleration: Positive = 0.3
    """Of the blends, mean [m/s^2, rad/s^2]."""
    loop: bool = False
    """Return to the start pose and begin anew, for ever, or stop at the last point."""

    @model_validator(mode="after")
    def _moves(self) -> PolylinePath:
        if not any(abs(value) > 1e-3 for point in self.points for value in point):
            raise ValueError("'points' never leave the start pose")
        return self


PathSpec = Annotated[SwayPath | CirclePath | PolylinePath, Field(discriminator="kind")]


class BaseTask(Documented):
    """What the platform is to do."""

    behaviour: Literal[
        "hold_still",
        "drive_to",
        "find_way",
        "position",
        "dock",
        "follow_path",
        "keep_in_reach",
        "program",
    ] = "hold_still"
    goal: Pose2 | None = None
    """For drive_to, find_way, position: X_OB to reach, x, y [m], heading [rad]. For program: its
    frame ``goal``."""
    distance: Annotated[float, Field(ge=0.2, le=5)] | None = None
    """For dock: from the middle of the platform to the surface [m]."""
    bearing_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """For dock: where from the platform the surface is to be, and is looked for [deg]."""
    path: PathSpec | None = None
    """For follow_path: relative to ``origin``."""
    origin: Pose2 | None = None
    """For follow_path: X_OB that the path starts from; if not given, where the platform is then."""
    program: str = ""
    """For program: one in base/programs (``approach.hds``), or a path beside the scenario."""
    object: Pose2 | None = None
    """For program: its frame ``object``, whose x axis points out of the object's front."""
    start_at: NonNegative = 0.0
    """The platform holds still before this robot time [s]."""
    avoid: bool = True
    """With a laser: stop before what it sees, make way, stand without it. Read at the start."""
    fusion: Literal["optimum", "weighted"] = "optimum"
    """How votes are made one command. Read at the start."""

    @model_validator(mode="after")
    def _complete(self) -> BaseTask:
        may = {
            "goal": ("drive_to", "find_way", "position", "program"),
            "distance": ("dock",),
            "path": ("follow_path",),
            "origin": ("follow_path",),
            "program": ("program",),
            "object": ("program",),
        }
        needs = {
            ("drive_to", "goal"),
            ("find_way", "goal"),
            ("position", "goal"),
            ("dock", "distance"),
            ("follow_path", "path"),
            ("program", "program"),
        }
        for key, behaviours in may.items():
            given = getattr(self, key) not in (None, "")
            if given and self.behaviour not in behaviours:
                raise ValueError(f"behaviour {self.behaviour!r} does not use {key!r}")
            if not given and (self.behaviour, key) in needs:
                raise ValueError(f"behaviour {self.behaviour!r} needs {key!r}")
        return self


class BoxTask(Documented):
    """The box to grasp, as it is believed to be."""

    size: tuple[Positive, Positive, Positive] = (0.203, 0.279, 0.178)
    """Along x, y, z of its frame X [m]; the palms take it across y."""


class BottleTask(Documented):
    """The bottle to fetch, as it is roughly known, and where to put it."""

    x: Metres = 0.0
    """Of its axis in O, within a centimetre or so [m]."""
    y: Metres = 0.0
    """[m]"""
    table: Positive = 0.5
    """Height of what it stands on, and is put on [m]."""
    grasp: Positive = 0.13
    """Where to take it, above its foot [m]."""
    radius: Positive = 0.05
    """Characteristic one, that weighs moments against forces [m]."""
    facing: Angle = 0.0
    """Heading with which the platform looks at the table, here and there [rad]."""
    goal: tuple[Metres, Metres] = (0.0, 0.5)
    """Where to put it: x, y in O [m]."""


class Task(Documented):
    """All that arm and base are told."""

    program: str = ""
    """Name of a program in arm/programs (``whiteboard.hds``) or a path beside the scenario."""
    autostart: bool = True
    """Start the program by itself at ``start_at``; otherwise a person does."""
    start_at: NonNegative = 0.5
    """Robot time at which the program starts [s]; live it starts when every service is ready."""
    shape_by_seed: bool = False
    """Set ``Shape`` of the program's nodes to the seed of the run, plus one."""
    board: BoardPose = BoardPose()
    """Where the board is believed to be: X_OS."""
    watch_board: bool = False
    """Follow the board by vision as odometry drifts against it."""
    box: BoxTask | None = None
    """For two arms: what they grasp, and the observer looks for."""
    bottle: BottleTask | None = None
    """For an arm with a hand: what it fetches."""
    base: BaseTask = BaseTask()


def find_program(
    program: str,
    beside: Path | None = None,
    folders: tuple[Path, ...] = (PROGRAMS,),
    key: str = "task.program",
) -> Path:
    """The file of a program.

    Args:
        program: name of a file in one of the folders, with or without ``.hds``, or a path.
        beside: folder that relative paths start from.
        folders: where programs of that name are looked for; by default those of the arm.
        key: what asks for it, named in the error; empty for a person.

    Raises:
        BadFile: there is none; the known ones are named.
    """
    name = program if program.endswith(".hds") else f"{program}.hds"
    candidates = [folder / name for folder in ((beside,) if beside else ()) + folders]
    for path in candidates:
        if path.is_file():
            return path
    known = sorted(p.name for folder in folders for p in folder.glob("*.hds"))
    own = [p.name for p in beside.glob("*.hds")] if beside else []
    # without the ending, which makes any two names alike
    stems = {p.removesuffix(".hds"): p for p in (*own, *known)}
    near = difflib.get_close_matches(name.removesuffix(".hds"), stems, n=1)
    hint = f" (did you mean {stems[near[0]]!r}?)" if near else ""
    asks = f"{key}: " if key else ""
    raise BadFile(candidates[0], [f"{asks}no program {program!r}{hint}. Known: {', '.join(known)}"])
