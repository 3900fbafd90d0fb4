"""Scenarios: the truth of a world, what goes wrong in it when, and what the controllers are told.

A scenario is a TOML file. ``[world]``, ``[sensors]`` and ``[[disturbance]]`` are the simulation's
alone; controllers are given ``[task]`` (``deploy/task.py``) and the robot's description.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal, TypeVar, get_args

from pydantic import Field, PrivateAttr, field_validator

from deploy.numbers import NonNegative, Positive, Vector3
from deploy.robot import MobileBase, robot_file, robot_names
from deploy.task import Angle, BoardPose, Documented, Metres, Pose2, Task, find_program
from deploy.tomlfile import BadFile, load_toml
from sim.disturbance import Disturbance, near
from sim.obstacle_specs import Obstacle

__all__ = [
    "SCENARIOS",
    "Board",
    "Bottle",
    "Mismatch",
    "Scenario",
    "Sensors",
    "World",
    "load_scenario",
    "scenario_names",
]

SCENARIOS = Path(__file__).parent / "scenarios"

Fraction = Annotated[float, Field(ge=0, le=0.9)]
Probability = Annotated[float, Field(ge=0, le=1)]
Slope = Annotated[float, Field(ge=-0.3, le=0.3)]
Nonnegative3 = tuple[NonNegative, NonNegative, NonNegative]
R = TypeVar("R", bound=MobileBase)


# --- the world ------------------------------------------------------------------------------


class Board(BoardPose):
    """The true board X_WS and the size of its drawing area."""

    width: Positive = 1.2
    """Along x_S [m]."""
    height: Positive = 0.9
    """Along y_S [m]."""
    markers: Annotated[tuple[Metres, ...], Field(max_length=20)] = (0.0,)
    """Where cameras find it: at these places along x_S, on the line y_S = 0 [m]."""


class Mismatch(Documented):
    """How far the simulated robot may differ from its description, drawn by seed; 0 is none."""

    inertia: Fraction = 0.05
    """Of every link's inertia, relative, either way."""
    friction: Fraction = 0.20
    """Of every joint's friction, relative, either way."""
    lag: Fraction = 0.10
    """Of the platform's lag, relative, either way."""
    payload: Annotated[float, Field(ge=0, le=2)] = 0.05
    """Mass at the tool [kg], either way."""
    sensor_noise: Annotated[float, Field(ge=0, le=10)] = 1.5
    """Noise up to this factor times the stated level; 1 or less leaves the stated level."""
    roughness: Nonnegative3 = (0.05, 0.05, 0.1)
    """Floor disturbance while driving, rms [m/s^2, m/s^2, rad/s^2] in B (Ornstein-Uhlenbeck)."""
    roughness_correlation: Positive = 0.3
    """Correlation time of the roughness [s]."""


class Table(Documented):
    """A table's top, 4 cm thick; its legs are in nobody's way."""

    x: Metres = 0.0
    """Of its middle in W [m]."""
    y: Metres = 0.0
    """[m]"""
    yaw: Angle = 0.0
    """Turn about the vertical [rad]."""
    size: tuple[Positive, Positive] = (0.7, 1.4)
    """Depth along its x, width along its y [m]."""
    height: Positive = 0.75
    """Of the top above the floor [m]."""


class Box(Documented):
    """A free box on the table; frame X in its middle, x from front to back, y along its width."""

    x: Metres = 0.0
    """X_WX at the start [m]."""
    y: Metres = 0.0
    """[m]"""
    yaw: Angle = 0.0
    """Turn about the vertical [rad]; 0 has its front towards -x of W."""
    on_side: bool = False
    """Rolled by a quarter turn about its x: the y side is then upright."""
    size: tuple[Positive, Positive, Positive] = (0.203, 0.279, 0.178)
    """Along x, y, z of X [m]."""
    mass: Positive = 1.5
    """[kg]"""
    friction: Annotated[float, Field(ge=0, le=2)] = 0.6
    """Coulomb friction coefficient against palms and table [1]."""
    com: Vector3 = (0.0, 0.0, 0.0)
    """Centre of mass in X [m]."""


class Bottle(Documented):
    """A free bottle on the table, at a yaw drawn by seed; its foot is its origin."""

    thing: Literal["bottle", "roll", "squirt", "detergent"] = "bottle"
    """Of ``sim/hand_objects.py``."""
    x: Metres = 0.0
    """Of its axis in W [m]."""
    y: Metres = 0.0
    """[m]"""
    scatter: NonNegative = 0.01
    """Largest distance from there along x and along y, drawn by seed [m]."""
    mass: Positive = 0.5
    """[kg]"""
    friction: Annotated[float, Field(ge=0, le=2)] = 0.5
    """Coulomb friction coefficient against tips and table [1]."""


class Start(Documented):
    """Where the platform starts, drawn by seed: around the box, or the table if there is none."""

    distance: tuple[Positive, Positive] = (2.0, 2.5)
    """From the box, between these [m]."""
    bearing: tuple[Angle, Angle] = (-1.0, 1.0)
    """As seen from the box, counter-clockwise from straight in front of it, between these [rad]."""
    heading: tuple[Angle, Angle] = (-0.3, 0.3)
    """Off looking at the box, between these [rad]."""


class World(Documented):
    """The truth, which only the simulation sees."""

    board: Board = Board()
    platform_start: Pose2 = (0.0, 0.0, 0.0)
    """X_WB at t = 0: x, y [m], heading [rad]; odometry starts there as well."""
    start: Start | None = None
    """Draw the start of such a robot instead of ``platform_start``."""
    table: Table = Table()
    """For a robot of two arms or with a hand."""
    box: Box | None = None
    """For a two-armed robot; none there if not given."""
    bottle: Bottle | None = None
    """For a robot with a hand; none there if not given."""
    floor_tilt: tuple[Slope, Slope] = (0.0, 0.0)
    """Rise of the floor along x and y of W [rad]; the accelerometer notices, the platform stays."""
    friction_pen: Annotated[float, Field(ge=0, le=2)] = 0.3
    """Coulomb friction coefficient of pen on board [1]."""
    obstacle: tuple[Obstacle, ...] = ()
    """What stands and walks around; the board is no obstacle, a wall behind it is."""
    mismatch: Mismatch = Mismatch()


# --- sensors --------------------------------------------------------------------------------


class OdometrySensor(Documented):
    """What differs from the robot's description; absent keys keep it."""

    enabled: bool = True
    rate: Annotated[float, Field(ge=1, le=200)] | None = None
    """[Hz]"""
    delay: Annotated[float, Field(ge=0, le=1)] | None = None
    """Sample to arrival [s]."""
    resolution: Nonnegative3 | None = None
    """x, y [m], heading [rad]; 0 is unlimited."""
    noise: Nonnegative3 = (0.0, 0.0, 0.0)
    """White, before quantisation, standard deviation [m, m, rad]."""
    scale: tuple[Positive, Positive] | None = None
    """What is read over what is true, of distance and of heading turned."""
    dropout: Probability = 0.0
    """Share of samples lost at random."""


class ImuSensor(Documented):
    """What differs from the robot's description; absent keys keep it."""

    enabled: bool = True
    rate: Annotated[float, Field(ge=1, le=1000)] | None = None
    """[Hz]"""
    delay: Annotated[float, Field(ge=0, le=1)] | None = None
    """Sample to arrival [s]."""
    gyro_noise: NonNegative | None = None
    """[rad/s] per sample."""
    gyro_bias: NonNegative | None = None
    """Standard deviation of the constant [rad/s]."""
    accel_noise: NonNegative | None = None
    """[m/s^2] per sample."""
    accel_bias: NonNegative | None = None
    """Standard deviation of the constant [m/s^2]."""
    dropout: Probability = 0.0
    """Share of samples lost at random."""


class LoadCellSensor(Documented):
    """What differs from the robot's description; absent keys keep it."""

    force_noise: NonNegative | None = None
    """[N] per sample."""
    moment_noise: NonNegative | None = None
    """[N m] per sample."""


class LaserSensor(Documented):
    """What differs from the robot's description; absent keys keep it."""

    enabled: bool = True
    rate: Annotated[float, Field(ge=1, le=100)] | None = None
    """[Hz]"""
    delay: Annotated[float, Field(ge=0, le=1)] | None = None
    """Sample to arrival [s]."""
    field_of_view: Annotated[float, Field(gt=0, le=2 * math.pi)] | None = None
    """Symmetric about x of B [rad]."""
    increment: Annotated[float, Field(ge=0.001, le=1)] | None = None
    """Between beams [rad]."""
    farthest: Annotated[float, Field(gt=0, le=1000)] | None = None
    """[m]"""
    noise: NonNegative | None = None
    """Of a range, standard deviation [m]."""
    dropout: Probability = 0.0
    """Share of scans lost at random."""


class BumperSensor(Documented):
    """What differs from the robot's description; absent keys keep it."""

    enabled: bool = True
    rate: Annotated[float, Field(ge=1, le=1000)] | None = None
    """[Hz]"""
    dropout: Probability = 0.0
    """Share of messages lost at random."""


class VisionSensor(Documented):
    """What differs from the robot's description; absent keys keep it."""

    enabled: bool = True
    rate: Annotated[float, Field(ge=1, le=200)] | None = None
    """[Hz]"""
    delay: Annotated[float, Field(ge=0, le=1)] | None = None
    """Sample to arrival [s]."""
    farthest: Positive | None = None
    """[m]"""
    field_of_view: Annotated[float, Field(gt=0, le=2 * math.pi)] | None = None
    """Full angle about x of B [rad]."""
    noise: tuple[NonNegative, NonNegative] | None = None
    """Of position [m] and rotation [rad] at distance zero, standard deviation."""
    noise_per_metre: tuple[NonNegative, NonNegative] | None = None
    """What each metre of distance adds [m/m], [rad/m]."""
    noise_per_metre_squared: tuple[NonNegative, NonNegative] | None = None
    """What the distance squared adds [m/m^2], [rad/m^2]; of a two-armed robot."""
    correlation: NonNegative | None = None
    """Time over which the error stays alike [s]; of a two-armed robot."""
    dropout: Probability = 0.0
    """Share of sightings lost at random."""


class Sensors(Documented):
    """How the sensors of this world differ from the robot's description."""

    odometry: OdometrySensor = OdometrySensor()
    imu: ImuSensor = ImuSensor()
    load_cell: LoadCellSensor = LoadCellSensor()
    laser: LaserSensor = LaserSensor()
    bumper: BumperSensor = BumperSensor()
    vision: VisionSensor = VisionSensor()

    def overlay(self, robot: R) -> R:
        """The robot with the rates, delays and noise of this world's sensors."""
        changed = {}
        for name in type(self).model_fields:
            described = getattr(robot, name)
            if described is None:
                continue
            ours = getattr(self, name).model_dump(exclude_none=True)
            update = {k: v for k, v in ours.items() if k in type(described).model_fields}
            changed[name] = described.model_copy(update=update)
        return robot.model_copy(update=changed)


# --- the scenario ---------------------------------------------------------------------------

ServiceName = Literal["sim", "observer", "arm", "base"]
_STARTING = get_args(ServiceName)


class Scenario(Documented):
    """One experiment."""

    description: str = ""
    robot: str = "xr4000_puma560"
    """Name of a folder in deploy/robots."""
    duration: Annotated[float, Field(gt=0, le=86400)] = 60.0
    """Limit of a run [s]; it ends earlier when the program has finished."""
    world: World = World()
    sensors: Sensors = Sensors()
    disturbance: tuple[Disturbance, ...] = ()
    """The timeline."""
    services: tuple[ServiceName, ...] = ("sim", "observer", "arm", "base")
    """Which of the robot's processes run; ``sim`` is always one of them."""
    record: Literal["full", "light"] = "full"
    """What the log keeps: every message, or the fast topics thinned to what people look at."""
    task: Task = Task()
    _path: Path = PrivateAttr(default=Path())

    @field_validator("robot")
    @classmethod
    def _is_there(cls, name: str) -> str:
        if not robot_file(name).is_file():
            known = robot_names()
            raise ValueError(f"no such robot{near(name, known)}. Known: {', '.join(known)}")
        return name

    @field_validator("services")
    @classmethod
    def _can_run(cls, names: tuple[ServiceName, ...]) -> tuple[ServiceName, ...]:
        """Each once, in starting order, none without what it cannot do without."""
        if "sim" not in names:
            raise ValueError("without 'sim' there is no robot")
        blind = [name for name in ("arm", "base") if name in names and "observer" not in names]
        if blind:
            raise ValueError(f"{' and '.join(map(repr, blind))} cannot do without 'observer'")
        return tuple(name for name in _STARTING if name in names)

    @property
    def path(self) -> Path:
        """The file it was read from; ``.`` if it was not."""
        return self._path

    @property
    def name(self) -> str:
        """The file's name without its ending."""
        return self._path.stem

    def program_path(self) -> Path | None:
        """File of the task's program, None if it has none.

        Raises:
            BadFile: no such program; the known ones are named.
        """
        if not self.task.program:
            return None
        try:
            return find_program(self.task.program, beside=self._path.parent)
        except BadFile as error:
            raise BadFile(self._path, error.findings) from None


def scenario_names() -> list[str]:
    """Names of the scenarios that come with the project."""
    return sorted(path.stem for path in SCENARIOS.glob("*.toml"))


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Load a scenario by its name in sim/scenarios, or from a file.

    Raises:
        BadFile: no such scenario (the known ones are named), or wrong entries, all at once.
    """
    path = Path(name_or_path)
    if path.suffix != ".toml" and path.parent == Path():
        named = SCENARIOS / f"{path.name}.toml"
        if not named.is_file():
            known = scenario_names()
            raise BadFile(
                named,
                [f"no scenario {path.name!r}{near(path.name, known)}. Known: {', '.join(known)}"],
            )
        path = named
    scenario = load_toml(path, Scenario)
    scenario._path = path
    return scenario
