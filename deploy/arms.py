"""What a description says of arms, and of what they end in."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from deploy.numbers import NonNegative, Positive
from deploy.tomlfile import Strict

Vector7 = tuple[float, float, float, float, float, float, float]
Names7 = tuple[str, str, str, str, str, str, str]


class Arm(Strict):
    """The arm, joint by joint, in the order of ``joints``: six, or seven with one to spare.

    Its links are ``link1``, ``link2`` (with its origin in the shoulder) ... to the last one (with
    its origin in the wrist).
    """

    urdf: str
    joints: Annotated[tuple[str, ...], Field(min_length=6, max_length=7)]
    torque_limit: tuple[Positive, ...]
    velocity_limit: tuple[Positive, ...]
    rotor_inertia: tuple[NonNegative, ...]
    coulomb_friction: tuple[NonNegative, ...]
    viscous_friction: tuple[NonNegative, ...]
    encoder_resolution: Positive
    rest: tuple[float, ...]
    """Posture at the start; with a joint to spare, the one it is drawn to at work [rad]."""
    reach: Positive
    force_limit: Positive

    @model_validator(mode="after")
    def _complete(self) -> Arm:
        for name in (
            "torque_limit",
            "velocity_limit",
            "rotor_inertia",
            "coulomb_friction",
            "viscous_friction",
            "rest",
        ):
            given = len(getattr(self, name))
            if given != len(self.joints):
                raise ValueError(f"{name} has {given} values for {len(self.joints)} joints")
        return self

    @property
    def links(self) -> tuple[str, ...]:
        """Names of the bodies that the joints move, from the shoulder on."""
        return tuple(f"link{i}" for i in range(1, len(self.joints) + 1))


class TwoArms(Strict):
    """Two arms of seven joints, mirror images: figures hold for both, from shoulder to wrist.

    Wherever joints of both are listed, the left arm's seven come first, then the right arm's.
    """

    urdf: str
    joints_left: Names7
    joints_right: Names7
    torque_limit: Vector7
    velocity_limit: Vector7
    rotor_inertia: Vector7
    coulomb_friction: Vector7
    viscous_friction: Vector7
    encoder_resolution: Positive
    rest_left: Vector7
    rest_right: Vector7
    reach: Positive
    """Shoulder to middle of the palm, stretched [m]."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of all 14 joints, left then right."""
        return self.joints_left + self.joints_right

    @property
    def rest(self) -> tuple[float, ...]:
        """Posture at the start, (14,) [rad]."""
        return self.rest_left + self.rest_right


class Pad(Strict):
    """A soft pad on a palm: its face gives way along the palm's normal and stays parallel to it."""

    stiffness: Positive
    """[N/m]"""
    damping: Positive
    """[N s/m]"""
    plateau: Positive
    """At this force its cells buckle: until its stroke is used up it resists no harder [N]."""
    stroke: Positive
    """By which the face can give way before the pad is as hard as what it is glued to [m]."""
    mass: Positive
    """Of what moves with the face, of the palm's in the URDF [kg]."""


class Palms(Strict):
    """Flat palms, one at the end of each arm, each on a load cell; masses are in the URDF.

    Frame P: origin in the middle of the palm, x across the hand, y along the normal (of a left
    palm -y looks at the right one), z from fingertips to heel.
    """

    links: tuple[str, str]
    """Bodies in the URDF, left then right."""
    size: tuple[Positive, Positive, Positive]
    """Along x, y, z of P [m]."""
    force_limit: Positive
    """That a hand survives [N]."""
    pad: Pad
    """What the palms are covered with."""


class HandArm(Strict):
    """The arm that carries a hand, joint by joint from shoulder to wrist."""

    urdf: str
    joints: Names7
    torque_limit: Vector7
    velocity_limit: Vector7
    coulomb_friction: Vector7
    """What its joints have where a trial asks for friction [N m]."""
    rest: Vector7
    reach: Positive
    """Shoulder to wrist, stretched [m]."""


class Hand(Strict):
    """A hand of three fingers with coupled joints and a load cell in every tip.

    Frame H: origin in the middle of the palm, z out of it, finger 0 towards -x.
    """

    palm: str
    drives: tuple[str, str, str, str]
    """Driven joints: the spread of fingers 1 and 2, then the flexion of fingers 0, 1, 2."""
    followers: tuple[tuple[str, str, float], ...]
    """Joints that go along: their name, their leader's, positions over the leader's."""
    tips: tuple[str, str, str]
    tip_radius: Positive
    torque_limit: tuple[Positive, Positive, Positive, Positive]
    coulomb_friction: tuple[NonNegative, NonNegative, NonNegative, NonNegative]
    """What its drives have where a trial asks for friction [N m]."""
    open: float
    """Flexion before closing [rad]."""
    force_limit: Positive
    """That a fingertip survives [N]."""


class Pen(Strict):
    """A pen on a spring-loaded prismatic joint; masses and lengths are in the URDF."""

    stiffness: Positive
    damping: NonNegative
    tip_radius: Positive
