"""Scenarios: the truth of a world, what goes wrong in it when, and what the controllers are told.

A scenario is a TOML file. ``[world]``, ``[sensors]`` and ``[[disturbance]]`` are the simulation's
alone; controllers are given ``[task]`` (``deploy/task.py``) and the robot's description.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, PrivateAttr, TypeAdapter, ValidationError

from deploy.robot import NonNegative, Positive, Robot
from deploy.task import BoardPose, Documented, Pose2, Task, find_program
from deploy.tomlfile import BadFile, load_toml

__all__ = [
    "KINDS",
    "SCENARIOS",
    "Bias",
    "Board",
    "Bump",
    "Delay",
    "Disturbance",
    "Dropout",
    "Mismatch",
    "Noise",
    "Push",
    "Scenario",
    "Sensors",
    "Slip",
    "World",
    "describe",
    "disturbance_from",
    "load_scenario",
    "scenario_names",
]

SCENARIOS = Path(__file__).parent / "scenarios"

Fraction = Annotated[float, Field(ge=0, le=0.9)]
Probability = Annotated[float, Field(ge=0, le=1)]
Direction = Annotated[float, Field(ge=-360, le=360)]
Nonnegative3 = tuple[NonNegative, NonNegative, NonNegative]
Sensor = Literal["odometry", "imu"]


# --- the world ------------------------------------------------------------------------------


class Board(BoardPose):
    """The true board X_WS and the size of its drawing area."""

    width: Positive = 1.2
    """Along x_S [m]."""
    height: Positive = 0.9
    """Along y_S [m]."""


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


class World(Documented):
    """The truth, which only the simulation sees."""

    board: Board = Board()
    platform_start: Pose2 = (0.0, 0.0, 0.0)
    """X_WB at t = 0: x, y [m], heading [rad]; odometry starts there as well."""
    friction_pen: Annotated[float, Field(ge=0, le=2)] = 0.3
    """Coulomb friction coefficient of pen on board [1]."""
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


class Sensors(Documented):
    """How the sensors of this world differ from the robot's description."""

    odometry: OdometrySensor = OdometrySensor()
    imu: ImuSensor = ImuSensor()
    load_cell: LoadCellSensor = LoadCellSensor()

    def overlay(self, robot: Robot) -> Robot:
        """The robot with the rates, delays and noise of this world's sensors."""
        changed = {}
        for name in ("odometry", "imu", "load_cell"):
            described = getattr(robot, name)
            ours = getattr(self, name).model_dump(exclude_none=True)
            update = {k: v for k, v in ours.items() if k in type(described).model_fields}
            changed[name] = described.model_copy(update=update)
        return robot.model_copy(update=changed)


# --- disturbances ---------------------------------------------------------------------------


class Timed(Documented):
    """Something that acts from ``t`` on."""

    t: NonNegative
    """Robot time at which it begins [s]."""

    @property
    def end(self) -> float:
        """Robot time at which it ends [s]; infinite if it stays."""
        return self.t + float(getattr(self, "duration", float("inf")))

    def active(self, now: float) -> bool:
        """Whether it acts at robot time ``now`` [s]."""
        return self.t <= now < self.end


class Push(Timed):
    """A horizontal force on the platform or on an arm link, at its centre of mass."""

    kind: Literal["push"] = "push"
    duration: Annotated[float, Field(gt=0, le=60)] = 0.2
    """[s]"""
    force: Annotated[float, Field(ge=0, le=2000)]
    """Magnitude [N]."""
    direction: Direction = 0.0
    """Towards, from x of the world counter-clockwise [deg]."""
    on: Literal["platform", "link1", "link2", "link3", "link4", "link5", "link6"] = "platform"
    """What is pushed."""


class Bump(Timed):
    """A vibration from the floor: sinusoidal, fading in and out over its duration."""

    kind: Literal["bump"] = "bump"
    duration: Annotated[float, Field(gt=0, le=60)] = 0.3
    """[s]"""
    amplitude: Annotated[float, Field(ge=0, le=20)] = 2.0
    """Peak vertical acceleration [m/s^2]."""
    yaw: Annotated[float, Field(ge=0, le=20)] = 0.0
    """Peak yaw acceleration [rad/s^2]."""
    frequency: Annotated[float, Field(gt=0, le=100)] = 10.0
    """[Hz]"""


class Slip(Timed):
    """The wheels slip: the platform moves and the odometry does not see it."""

    kind: Literal["slip"] = "slip"
    duration: Annotated[float, Field(gt=0, le=60)] = 0.5
    """[s]"""
    distance: Annotated[float, Field(ge=0, le=2)]
    """Moved unseen [m]."""
    direction: Direction = 0.0
    """Towards, from x of the world counter-clockwise [deg]."""


class Dropout(Timed):
    """A sensor says nothing."""

    kind: Literal["dropout"] = "dropout"
    duration: Annotated[float, Field(gt=0, le=3600)] = 1.0
    """[s]"""
    sensor: Sensor


class Delay(Timed):
    """A sensor's samples arrive later than they should; their stamps stay true."""

    kind: Literal["delay"] = "delay"
    duration: Annotated[float, Field(gt=0, le=3600)] = 1.0
    """[s]"""
    sensor: Sensor
    extra: Annotated[float, Field(ge=0, le=1)]
    """On top of the sensor's own delay [s]."""


class Noise(Timed):
    """A sensor's noise grows."""

    kind: Literal["noise"] = "noise"
    duration: Annotated[float, Field(gt=0, le=3600)] = 1.0
    """[s]"""
    sensor: Sensor
    factor: Annotated[float, Field(ge=0, le=100)]
    """Of the standard deviation [1]."""


class Bias(Timed):
    """An inertial sensor's bias jumps, and stays."""

    kind: Literal["bias"] = "bias"
    sensor: Literal["gyro", "accel"]
    value: Annotated[float, Field(ge=-10, le=10)]
    """Added to the bias: gyro [rad/s], accelerometer [m/s^2]."""
    axis: Literal["x", "y", "z"] | None = None
    """Of the sensor; z of a gyro and x of an accelerometer if not given."""

    @property
    def axis_index(self) -> int:
        """0, 1 or 2."""
        return "xyz".index(self.axis or ("z" if self.sensor == "gyro" else "x"))


Disturbance = Annotated[
    Push | Bump | Slip | Dropout | Delay | Noise | Bias, Field(discriminator="kind")
]

KINDS: dict[str, type[Timed]] = {
    str(kind.model_fields["kind"].default): kind for kind in get_args(get_args(Disturbance)[0])
}
"""Every kind of disturbance by its name."""

_DISTURBANCE: TypeAdapter[Any] = TypeAdapter(Disturbance)


def describe(kind: str) -> dict[str, str]:
    """The options of a kind of disturbance: name to meaning, allowed values and default."""
    out = {}
    for name, info in KINDS[kind].model_fields.items():
        if name == "kind":
            continue
        schema = KINDS[kind].model_json_schema()["properties"][name]
        schema = {**schema, **schema.get("anyOf", [{}])[0]}
        parts = [(info.description or "").rstrip(".")]
        if "enum" in schema:
            parts.append("one of " + ", ".join(schema["enum"]))
        lo = schema.get("minimum", schema.get("exclusiveMinimum"))
        hi = schema.get("maximum")
        if hi is not None:
            parts.append(f"{lo:g} to {hi:g}")
        if name == "t":
            parts.append("default: now")
        elif info.is_required():
            parts.append("required")
        elif info.default is not None:
            parts.append(f"default {info.default}")
        out[name] = "; ".join(part for part in parts if part)
    return out


def disturbance_from(kind: str, options: Mapping[str, Any], now: float) -> Timed:
    """A disturbance asked for live.

    Args:
        kind: one of ``KINDS``.
        options: its options, as numbers or as text; without ``t`` it begins now.
        now: robot time [s].

    Raises:
        ValueError: unknown kind or option, or a value out of range; the text says what is allowed.
    """
    if kind not in KINDS:
        raise ValueError(f"no disturbance {kind!r}{_near(kind, KINDS)}. Known: {', '.join(KINDS)}")
    try:
        made: Timed = _DISTURBANCE.validate_python({"t": max(now, 0.0), **options, "kind": kind})
    except ValidationError as error:
        allowed = describe(kind)
        findings = []
        for e in error.errors():
            name = str(e["loc"][-1])
            if e["type"] == "extra_forbidden":
                findings.append(f"no option {name!r}{_near(name, allowed)}")
            elif e["type"] == "missing":
                findings.append(f"{name!r} is missing")
            else:
                findings.append(f"{name} = {e['input']!r}: {e['msg']}")
        listing = "\n".join(f"  {name}: {text}" for name, text in allowed.items())
        raise ValueError(f"{kind}: {'; '.join(findings)}. Allowed:\n{listing}") from None
    return made


# --- the scenario ---------------------------------------------------------------------------


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
    task: Task = Task()
    _path: Path = PrivateAttr(default=Path())

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
                [f"no scenario {path.name!r}{_near(path.name, known)}. Known: {', '.join(known)}"],
            )
        path = named
    scenario = load_toml(path, Scenario)
    scenario._path = path
    return scenario


def _near(name: str, known: Mapping[str, Any] | list[str]) -> str:
    near = difflib.get_close_matches(name, list(known), n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""
