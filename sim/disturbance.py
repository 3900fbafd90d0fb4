"""Disturbances: what can go wrong, from a scenario's timeline or asked for live."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, TypeAdapter, ValidationError

from deploy.numbers import NonNegative
from deploy.task import Documented

Direction = Annotated[float, Field(ge=-360, le=360)]
Sensor = Literal["odometry", "imu", "laser", "vision", "bumper"]
Body = Literal[
    "platform",
    "link1",
    "link2",
    "link3",
    "link4",
    "link5",
    "link6",
    "link7",
    "torso",
    "left_link1",
    "left_link2",
    "left_link3",
    "left_link4",
    "left_link5",
    "left_link6",
    "left_link7",
    "left_palm",
    "right_link1",
    "right_link2",
    "right_link3",
    "right_link4",
    "right_link5",
    "right_link6",
    "right_link7",
    "right_palm",
    "box",
    "mount",
    "palm",
    "finger0_base",
    "finger0_near",
    "finger0_far",
    "tip0",
    "finger1_base",
    "finger1_near",
    "finger1_far",
    "tip1",
    "finger2_base",
    "finger2_near",
    "finger2_far",
    "tip2",
    "object",
]
"""What can be pushed, on one robot or another."""


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
    """A horizontal force on the platform, an arm link or the box, at its centre of mass."""

    kind: Literal["push"] = "push"
    duration: Annotated[float, Field(gt=0, le=60)] = 0.2
    """[s]"""
    force: Annotated[float, Field(ge=0, le=5000)]
    """Magnitude [N]."""
    direction: Direction = 0.0
    """Towards, from x of the world counter-clockwise [deg]."""
    on: Body = "platform"
    """What is pushed; the robot must have it."""


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
    sensor: Literal["odometry", "imu", "laser", "vision"]
    factor: Annotated[float, Field(ge=0, le=100)]
    """Of the standard deviation [1]."""


class Blinded(Timed):
    """A sensor goes on speaking but sees nothing: a laser reports 0 in every beam."""

    kind: Literal["blinded"] = "blinded"
    duration: Annotated[float, Field(gt=0, le=3600)] = 1.0
    """[s]"""
    sensor: Literal["laser", "vision"]


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


class BoardShift(Timed):
    """The whiteboard is pushed along the floor, away from the arm or into it, and stays there."""

    kind: Literal["board"] = "board"
    over: Annotated[float, Field(gt=0, le=60)] = 0.5
    """Time it takes, from rest to rest [s]."""
    distance: Annotated[float, Field(ge=0, le=1)]
    """[m]"""
    direction: Direction = 0.0
    """Towards, from x of the world counter-clockwise [deg]."""


Disturbance = Annotated[
    Push | Bump | Slip | Dropout | Delay | Noise | Blinded | Bias | BoardShift,
    Field(discriminator="kind"),
]

KINDS: dict[str, type[Timed]] = {
    str(kind.model_fields["kind"].default): kind for kind in get_args(get_args(Disturbance)[0])
}
"""Every kind of disturbance by its name."""

_DISTURBANCE: TypeAdapter[Any] = TypeAdapter(Disturbance)


def describe(kind: str, bodies: Sequence[str] = ()) -> dict[str, str]:
    """The options of a kind of disturbance: name to meaning, allowed values and default.

    Args:
        kind: one of ``KINDS``.
        bodies: what can be pushed on the robot in question; of every robot if not given.
    """
    out = {}
    for name, info in KINDS[kind].model_fields.items():
        if name == "kind":
            continue
        schema = KINDS[kind].model_json_schema()["properties"][name]
        schema = {**schema, **schema.get("anyOf", [{}])[0]}
        parts = [(info.description or "").rstrip(".")]
        if "enum" in schema:
            own = bodies if name == "on" and bodies else schema["enum"]
            parts.append("one of " + ", ".join(own))
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


def disturbance_from(
    kind: str, options: Mapping[str, Any], now: float, bodies: Sequence[str] = ()
) -> Timed:
    """A disturbance asked for live.

    Args:
        kind: one of ``KINDS``.
        options: its options, as numbers or as text; without ``t`` it begins now.
        now: robot time [s].
        bodies: what can be pushed here, for the text of an error; of every robot if not given.

    Raises:
        ValueError: unknown kind or option, or a value out of range; the text says what is allowed.
    """
    if kind not in KINDS:
        raise ValueError(f"no disturbance {kind!r}{near(kind, KINDS)}. Known: {', '.join(KINDS)}")
    try:
        made: Timed = _DISTURBANCE.validate_python({"t": max(now, 0.0), **options, "kind": kind})
    except ValidationError as error:
        allowed = describe(kind, bodies)
        findings = []
        for e in error.errors():
            name = str(e["loc"][-1])
            if e["type"] == "extra_forbidden":
                findings.append(f"no option {name!r}{near(name, allowed)}")
            elif e["type"] == "missing":
                findings.append(f"{name!r} is missing")
            elif name == "on" and bodies:
                findings.append(f"no {e['input']!r} here{near(str(e['input']), bodies)}")
            else:
                findings.append(f"{name} = {e['input']!r}: {e['msg']}")
        listing = "\n".join(f"  {name}: {text}" for name, text in allowed.items())
        raise ValueError(f"{kind}: {'; '.join(findings)}. Allowed:\n{listing}") from None
    return made


def refuse_absent(disturbance: Timed, bodies: Sequence[str]) -> None:
    """Refuse to push what is not there.

    Raises:
        ValueError: ``bodies``, which the text lists, have none of that name.
    """
    if isinstance(disturbance, Push) and disturbance.on not in bodies:
        raise ValueError(f"push: no {disturbance.on!r} here. Known: {', '.join(bodies)}")


def near(name: str, known: Iterable[str]) -> str:
    """A hint at the known name that is nearest to ``name``; empty if none is near."""
    near = difflib.get_close_matches(name, list(known), n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""
