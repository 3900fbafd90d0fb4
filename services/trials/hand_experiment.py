"""What the grasp experiments share: options, and from them world, plan and figures."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from pydantic import Field

from arm.hand.plan import Plan, gently
from services.trials.experiment import Options as Base
from services.trials.experiment import Row
from services.trials.hand_figures import figures
from services.trials.hand_run import Start, run_hand
from sim.hand_world import HandMismatch, Setting

ARM_KNOWN, HAND_KNOWN = 1.0, 1.0
"""Shares of described joint friction that are fed forward; the true one differs by 20 %."""


Controller = Literal["sum", "null", "force", "moment", "sequential", "printed", "curvature"]
"""As of ``arm.hand.sliding.Way``; the last two for three contacts only."""


class Options(Base):
    """What may be chosen."""

    lift: bool = False
    """The object stands free, friction 0.5, and is lifted, shaken and pushed; else it is fixed."""
    controller: Controller = "sum"
    tries: int = Field(default=3, ge=1, le=5)
    """Reaches, the first included."""
    tilt: tuple[float, float] | None = None
    """Of first reaches from the axis, from, to; the experiment's own if not stated [rad]."""
    friction: float | None = Field(default=None, gt=0.0, le=1.5)
    """Of the object; 0.3 fixed, 0.5 free if not stated."""
    mass: float = Field(default=0.5, gt=0.0, le=3.0)
    """Of the object [kg]."""
    joint_friction: Literal["none", "arm", "hand", "both"] = "none"
    mismatch: float = Field(default=0.0, ge=0.0, le=0.2)
    """Of masses and inertias, each way."""
    fault: Literal["none", "missing", "big", "slippery", "dead"] = "none"
    """Nothing there; 1.6 times as wide; friction 0.05; finger 1's load cell dead."""


def run_thing(
    seed: int, options: Options, thing: str, plan: Plan, tilt: tuple[float, float]
) -> Row:
    """One trial of a grasp of an object.

    Args:
        seed: of the trial.
        options: as chosen.
        thing: the object.
        plan: how to grasp it.
        tilt: of reaches from the object's axis, from, to [rad].
    """
    way = replace(plan.way, kind=options.controller)
    plan = replace(plan, way=way, tries=options.tries)
    if options.lift:
        plan = gently(plan, 0.12)
    usual = 0.05 if options.fault == "slippery" else 0.5 if options.lift else 0.3
    setting = Setting(
        thing=None if options.fault == "missing" else thing,
        fixed=not options.lift,
        friction=options.friction or usual,
        mass=options.mass,
        scale=1.6 if options.fault == "big" else 1.0,
        arm_friction=options.joint_friction in ("arm", "both"),
        finger_friction=options.joint_friction in ("hand", "both"),
        dead=1 if options.fault == "dead" else None,
        mismatch=HandMismatch(inertia=options.mismatch),
    )
    fed = (
        ARM_KNOWN if setting.arm_friction else 0.0,
        HAND_KNOWN if setting.finger_friction else 0.0,
    )
    return figures(run_hand(seed, setting, plan, Start(options.tilt or tilt), fed))
