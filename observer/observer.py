"""One door to every observer: `make_observer` by name, `Observer` as what they all do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from deploy.robot import MobileBase
from observer.baselines import Hold, Taylor, TruthReference
from observer.ekf_observer import EkfObserver
from observer.observer_options import ObserverOptions
from services.messages import BaseCommand, Estimate, Imu, Odometry, WheelSpeed

KINDS = ("ekf", "imm", "undelayed", "taylor", "hold", "truth")

__all__ = ["KINDS", "Observer", "ObserverOptions", "make_observer"]


class Observer(Protocol):
    """Estimates the motion of the platform at an instant from what arrived until then."""

    def step(
        self,
        now: float,
        odometry: Sequence[Odometry] = (),
        imu: Sequence[Imu] = (),
        commands: Sequence[BaseCommand] = (),
        speeds: Sequence[WheelSpeed] = (),
    ) -> Estimate:
        """Take in what arrived since the last tick; estimate at ``now`` [s].

        Args:
            now: robot time [s], normally larger than at the last tick.
            odometry: poses X_OB that arrived; each carries the instant it was sampled.
            imu: readings that arrived, likewise.
            commands: platform commands V_OB_B that arrived, stamped when computed.
            speeds: wheel speeds V_OB_B that arrived, for platforms that give those.

        Returns:
            Estimate with ``t == now``: X_OB, V_OB_O, A_OB_O, covariance and report.
        """
        ...


def make_observer(
    kind: str, robot: MobileBase, *, options: ObserverOptions | None = None, order: int = 1
) -> Observer:
    """Build an observer.

    Args:
        kind: ``ekf``, ``imm`` (all modes at once), ``undelayed`` (as if nothing came late),
            ``taylor``, ``hold`` or ``truth``.
        robot: what the robot is: delays, noises, lag, lever arm.
        options: of ``ekf``, ``imm`` and ``undelayed``.
        order: of ``taylor``.

    Raises:
        ValueError: unknown kind; the valid names are listed.
    """
    if kind == "ekf":
        return EkfObserver(robot, options)
    options = options or ObserverOptions()
    if kind == "imm":
        return EkfObserver(robot, replace(options, filter=replace(options.filter, modes="imm")))
    if kind == "undelayed":
        return EkfObserver(robot, replace(options, undelayed=True))
    if kind == "taylor":
        return Taylor(robot, order)
    if kind == "hold":
        return Hold(robot)
    if kind == "truth":
        return TruthReference()
    raise ValueError(f"unknown observer {kind!r}. Valid: {', '.join(KINDS)}")
