"""Grasps an object from touch alone: close, slide, try again from elsewhere, squeeze, lift, hold.

The phases of a try are ``tare``, ``close``, ``slide``; what got stuck, struck or lost touch backs
off (``away``) to a reach near the object's axis and tries again, a refinement: it returns to a
controller whose goal the failed one started from. After convergence come ``grip``, ``lift`` and
``hold``. ``stopped`` is the end of what did not work; ``Grasp.outcome`` says what it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from arm.hand.feel import Feel
from arm.hand.law import Law
from arm.hand.model import FINGERS, FLEX, JOINTS, HandModel, Placed
from arm.hand.plan import Plan
from arm.hand.reaching import Guess, Path
from arm.hand.sliding import PERIOD, Slider
from arm.hand.squeeze import internal
from arm.hand.ways import elsewhere, upwards

Array = NDArray[np.float64]

TARE, CLOSE, RAMP = 0.2, 4.0, 0.1
"""Time for taring, for all fingers to touch, for forces to build up [s]."""
STRUCK, LOST = 0.05, 0.3
"""Time after which a link on the object, or a tip off it, ends a try [s]."""
INTEGRAL, TRIM = 5.0, 0.5
"""Rate at which the press is corrected by what the cells feel [1/s], at most by this share."""
FREE = 5.0
"""Force on a tip that ends a way through the air [N]."""
BEHIND, BLOCKED, WAYS = 0.03, 1.0, 4
"""Joint error at which a way waits [rad], for how long it does [s]; ways on which it may be met."""
BRISK, SLOWEST = 1.6, 0.1
"""Rate of a joint from which on sliding slows down [rad/s], to this share at most: near a
singular posture the arm runs after what a tip does at leisure."""
SLID = 15
"""Updates from which on a try has learned something of the object's shape."""
STRETCHED, CURLED = 0.35, 1.8
"""Flexions beyond which a link would strike the object next [rad]."""
RATE, FIRST = 0.4, 0.6
"""Fingers close with this [rad/s], and press with this once they touch [N]."""


@dataclass
class Try:
    """What a reach came to.

    Attributes:
        end: ``converged``, or why it ended.
        updates: from the third touch to the end or convergence.
        history: residuals |rho|, |M|, a pair an update, settling included.
        normals, points: last contacts, in B, shape (3, 3).
        first: normals and points when the third finger touched.
    """

    end: str = ""
    updates: int = 0
    history: list[tuple[float, float]] = field(default_factory=list)
    normals: Array | None = None
    points: Array | None = None
    first: tuple[Array, Array] | None = None


def line_of(tries: Sequence[Try]) -> Array | None:
    """From finger 0 to the pair where the newest try that slid for a while ended, in B, (3,)."""
    for one in reversed(tries):
        if one.points is not None and len(one.history) > SLID:
            return np.asarray(one.points[1:].mean(axis=0) - one.points[0])
    return None


class Grasp:
    """Stepped with what the hand's sensors say; answers with torques.

    Args:
        model: as believed.
        plan: how to grasp.
        guess: where the object is believed to stand.
        rng: for reaches after the first.
        friction: share of described joint friction to feed forward, arm and hand.

    Attributes:
        phase: see the module.
        outcome: in words, empty while it goes on.
        tries: reaches so far, the last the present one.
        slider: of the present try, None before the third touch.
    """

    def __init__(
        self,
        model: HandModel,
        plan: Plan,
        guess: Guess,
        rng: np.random.Generator,
        friction: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self.model, self.plan, self._guess, self._rng = model, plan, guess, rng
        self.law = Law(model, friction=friction)
        self.feel = Feel(model.robot.hand.tip_radius)
        self.phase, self.outcome = "tare", ""
        self.tries: list[Try] = [Try()]
        self.slider: Slider | None = None
        self._since = self._last = self._update = 0.0
        self._begun = False
        self._samples: list[Array] = []
        self._reference = np.zeros(JOINTS)
        self._path: Path | None = None
        self._along = self._waited = 0.0
        self._met = 0
        self._pace = 1.0
        self._touched = np.zeros(FINGERS, dtype=bool)
        self._struck = 0.0
        self._off = np.zeros(FINGERS)
        self._grip = 0.0
        self._press = np.array(plan.press)
        self._trim = np.zeros(FINGERS)
        self._posture = np.array([plan.spread] + [plan.flexion] * 3)
        self._bandwidth = np.repeat(plan.stiff, [7, 4])

    def step(self, t: float, q: Array, qd: Array, cells: Array, struck: bool) -> Array:
        """One period, torques of the driven joints, shape (11,) [N m].

        Args:
            t: time [s].
            q, qd: measured, shape (11,) [rad], [rad/s].
            cells: wrenches of the tips' load cells in their frames, shape (3, 6) [N], [N m].
            struck: switches in palm and links say that one of them touches something.
        """
        if not self._begun:
            self._begun, self._reference = True, q.copy()
            self._since = self._last = self._update = t
        dt, self._last = t - self._last, t
        at = self.model.place(q, qd)
        self.feel.add(cells)
        if self.phase == "tare":
            self._samples.append(cells)
        elif t - self._update >= PERIOD - 1e-9:
            self._update = t
            self.feel.update(self.model.tip_rotations())
            self._sense(t, at)
        self._struck = self._struck + dt if struck else 0.0
        self._judge(t, at)
        self.law.friction.see(dt, at, self.feel.force)
        tau = self._torque(t, dt, at)
        self.law.friction.sent(tau)
        return tau

    # --- what to do -------------------------------------------------------------------------

    def _enter(self, phase: str, t: float, at: Placed) -> None:
        self.phase, self._since = phase, t
        self._struck = 0.0
        self._off[:] = 0.0
        if phase == "tare":
            self._samples = []
        if phase in ("grip", "stopped"):
            self._reference = at.q.copy()

    def _sense(self, t: float, at: Placed) -> None:
        """At 50 Hz: contacts, sliding."""
        feel, mine = self.feel, self.tries[-1]
        self._off = np.where(feel.touching, 0.0, self._off + PERIOD)
        hardest = float(np.linalg.norm(feel.force, axis=1).max())
        if self.phase == "close":
            self._touched |= feel.touching
            if self._touched.all():
                self.slider = Slider(self.plan.way, at.x)
                mine.first = (feel.normals.copy(), feel.points(at.x))
                self.law.reset()
                self._trim[:] = 0.0
                self._pace = 1.0
                self._enter("slide", t, at)
        if self.phase == "slide":
            assert self.slider is not None
            points = feel.points(at.x)
            fastest = float(np.abs(at.qd).max())
            self._pace = min(1.0, self._pace * float(np.sqrt(BRISK / max(fastest, 1e-3))))
            self._pace = max(self._pace, SLOWEST)
            self.slider.update(feel.normals, points, at.x, self._pace)
            mine.updates, mine.history = self.slider.updates, self.slider.history
            mine.normals, mine.points = feel.normals.copy(), points
            pressed = np.sum(-feel.force * feel.normals, axis=1)
            self._trim += INTEGRAL * PERIOD * np.where(feel.touching, self._press - pressed, 0.0)
            self._trim = np.clip(self._trim, -TRIM * self._press, TRIM * self._press)
        if self.phase in ("close", "slide") and hardest > self.plan.hardest:
            self._fail("too much force on a fingertip", t, at)

    def _judge(self, t: float, at: Placed) -> None:
        """Whether a phase is over."""
        took = t - self._since
        if self.phase == "tare" and took >= TARE:
            dead = self.feel.tare(np.array(self._samples))
            self.feel.forget()
            self._touched[:] = False
            self.slider = None
            self._update = t  # a mean of few samples would touch what is not there
            self._enter("close", t, at)
            if dead:
                self._stop(f"load cell of finger {dead[0]} is dead", t, at)
        elif self.phase == "close":
            # distal links of fingers that close on nothing meet each other before this
            closed = bool((self._reference[FLEX][~self._touched] > 1.9).any())
            if took > CLOSE or closed:
                count = int(self._touched.sum())
                self._fail("nothing there" if count == 0 else f"{count} of 3 fingers touch", t, at)
            elif self._struck > STRUCK:
                self._fail("a link struck the object", t, at)
        elif self.phase == "slide":
            assert self.slider is not None
            if self._struck > STRUCK:
                self._fail("a link struck the object", t, at)
            elif self._off.max() > LOST:
                self._fail("lost touch", t, at)
            elif at.q[FLEX].min() < STRETCHED or at.q[FLEX].max() > CURLED:
                self._fail("fingers out of their range", t, at)
            elif self.slider.stuck:
                self._fail("stuck", t, at)
            elif self.slider.converged and self.slider.settled * PERIOD >= self.plan.settle:
                self.tries[-1].end = "converged"
                if self.plan.lift <= 0.0:
                    self._stop("converged", t, at)
                else:
                    self._enter("grip", t, at)
        elif self.phase == "grip" and took >= 0.6:
            self._path = upwards(self.model, self._reference, self.plan.lift, self._rng)
            self._enter("lift", t, at)
        elif self.phase == "lift":
            assert self._path is not None
            if took >= self._path.duration + 0.2:
                self._reference = self._path.at(np.inf)[0]
                self._enter("hold", t, at)
        elif self.phase == "away":
            assert self._path is not None
            met = self._struck > 0.0 or self.feel.sharp.max() > FREE
            if self._waited > BLOCKED or (met and self._along > self._path.begins(2)):
                self._met += 1
                if self._met < WAYS:
                    self._leave(t, at)
                else:
                    self._stop("met something on its way", t, at)
            elif self._along >= self._path.duration + 0.3:
                self._reference = self._path.at(np.inf)[0]
                self.tries.append(Try())
                self._enter("tare", t, at)
        if self.phase in ("lift", "hold") and self._off.max() > LOST:
            self._stop("the object slipped away", t, at)

    def _fail(self, why: str, t: float, at: Placed) -> None:
        """End a try; reach anew if there are tries left."""
        self.tries[-1].end = why
        if len(self.tries) < self.plan.tries:
            self._met = 0
            self._leave(t, at)
        else:
            self._stop(why, t, at)

    def _leave(self, t: float, at: Placed) -> None:
        """Off the object and to it again from elsewhere."""
        self._path = elsewhere(
            self.model, self._guess, self.plan, at, line_of(self.tries), self._rng
        )
        self._along = self._waited = 0.0
        if self._path is None:
            self._stop(self.tries[-1].end, t, at)
        else:
            self._enter("away", t, at)

    def _stop(self, why: str, t: float, at: Placed) -> None:
        self.outcome = self.outcome or why
        self.tries[-1].end = self.tries[-1].end or why
        self._enter("stopped", t, at)

    # --- torques ----------------------------------------------------------------------------

    def _torque(self, t: float, dt: float, at: Placed) -> Array:
        took = t - self._since
        still, none = np.zeros(JOINTS), np.zeros((FINGERS, 3))
        if self.phase == "slide":
            assert self.slider is not None
            force = FIRST + min(1.0, took / RAMP) * (self._press - FIRST) + self._trim
            expected = np.full(FINGERS, self.plan.friction)
            return self.law.slide(
                dt,
                at,
                self.feel.normals,
                self.slider.references + (t - self._update) * self.slider.rates,
                force,
                expected,
                self._posture,
                self.slider.rates,
            )
        if self.phase == "close":
            rates = still.copy()
            rates[FLEX] = np.where(self._touched, 0.0, RATE)
            self._reference[FLEX] = np.where(
                self._touched, at.q[FLEX], self._reference[FLEX] + RATE * dt
            )
            free = np.zeros(JOINTS, dtype=bool)
            free[FLEX] = self._touched
            tau = self.law.follow(at, self._reference, rates, free, none)
            for finger in np.flatnonzero(self._touched):
                tau += self.law.press(at, int(finger), FIRST * self.feel.normals[finger])
            return tau
        locked = np.zeros(JOINTS, dtype=bool)
        if self.phase in ("grip", "lift", "hold"):
            share = min(1.0, took / 0.4) if self.phase == "grip" else 1.0
            squeeze = share * self.plan.grip * internal(at.x, self.plan.way.pair)
            q, qd = self._reference, still
            if self.phase == "lift":
                assert self._path is not None
                q, qd = self._path.at(took)
            return self.law.follow(at, q, qd, locked, squeeze, self._bandwidth)
        if self.phase == "away":
            assert self._path is not None
            # what is in the way holds the reference up: it is not pushed ever harder
            q, _ = self._path.at(self._along)
            pace = float(np.clip(2.0 - np.abs(q - at.q).max() / BEHIND, 0.0, 1.0))
            self._along += pace * dt
            self._waited = self._waited + dt if pace < 0.1 else 0.0
            q, qd = self._path.at(self._along)
            return self.law.follow(at, q, pace * qd, locked, none)
        return self.law.follow(at, self._reference, still, locked, none)
