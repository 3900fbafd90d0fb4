"""The objectives of the grasp, each for both palms at once (Platt et al., section III-A.3).

Rows are of joint rates of both arms, (m, 14), in B. A palm that an objective has nothing to say
about gives no rows, so that those below have its freedom.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Objective, Rows
from arm.grasping.glide import Glide
from arm.grasping.model import JOINTS, SIDES
from arm.grasping.scene import Scene

Array = NDArray[np.float64]

_NOTHING = Rows(np.zeros((0, JOINTS)), np.zeros(0), 0.0)
_UP = np.array([0.0, 0.0, 1.0])


def stack(rows: list[Array], rates: list[float]) -> Rows:
    """Rows of both palms; inactive if there are none."""
    if not rows:
        return _NOTHING
    return Rows(np.array(rows), np.array(rates))


class Reach(Objective):
    """Φ_reach: both palms onto the line through the box's middle, across its sides.

    Two constraints a palm, so that it may slide along the line. Within ``dead`` of the line it asks
    for no motion, but keeps its rows: what is subject to it shall not leave the line.

    Attributes:
        dead: radius of the dead zone [m].
        glide: of the palms, along and up, against their targets.
    """

    name = "reach"
    FASTEST = 0.51
    """Of a palm, in the middle of its way [m/s]."""

    def __init__(self) -> None:
        self.dead = 0.0
        self.glide = Glide((2, 2), self.FASTEST)

    def offsets(self, scene: Scene) -> Array:
        """From each palm to its target, along and up, shape (2, 2) [m]."""
        assert scene.box is not None
        along, p = scene.box.along, scene.box.p
        return np.array([[along @ (p - x), p[2] - x[2]] for x in scene.palms.p])

    def drift(self, scene: Scene) -> Array:
        """Velocity of the targets along and up, shape (2, 2) [m/s]."""
        assert scene.box is not None
        v = [float(scene.box.along @ scene.box.velocity), 0.0]
        return np.array([v, v])

    def error(self, kinematics: Any) -> Array:
        """Distances of the palms from their targets, shape (2,) [m]."""
        return np.asarray(np.linalg.norm(self.offsets(kinematics), axis=1))

    def begin(self, scene: Scene) -> float:
        """Start from rest; how long it will take [s], the same for both palms."""
        took = self.glide.duration(float(self.error(scene).max()))
        self.glide.begin(took)
        return took

    def speeds(self, offsets: Array, dt: float) -> Array:
        """Of both palms against their targets, along and up, shape (2, 2) [m/s]."""
        distance = np.maximum(np.linalg.norm(offsets, axis=1, keepdims=True), 1e-9)
        return self.glide.step(offsets * np.maximum(1.0 - self.dead / distance, 0.0), dt)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Towards the line, both palms at once."""
        scene: Scene = kinematics
        assert scene.box is not None
        axes = np.array([scene.box.along, _UP])
        rate = self.drift(scene) + self.speeds(self.offsets(scene), dt)
        J = [axes @ palm[:3] for palm in scene.palms.J]
        return Rows(np.concatenate(J), rate.ravel())


class Carry(Reach):
    """Φ_reach with the line moved up and down: each palm keeps its place on the box, in B.

    Attributes:
        height: how far above where it was captured the line is [m], and ``speed`` [m/s].
    """

    name = "carry"
    gain = 5.0
    fastest = 0.30

    def __init__(self) -> None:
        super().__init__()
        self.height = self.speed = 0.0
        self._places: list[Array] = []

    def capture(self, scene: Scene) -> None:
        """Keep the palms where they are from now on."""
        self.height = self.speed = 0.0
        self._places = [p.copy() for p in scene.palms.p]

    def offsets(self, scene: Scene) -> Array:
        """See ``Reach``."""
        assert scene.box is not None
        along = scene.box.along
        pairs = zip(self._places, scene.palms.p, strict=True)
        return np.array([[along @ (a - p), a[2] + self.height - p[2]] for a, p in pairs])

    def drift(self, scene: Scene) -> Array:
        """See ``Reach``."""
        return np.array([[0.0, self.speed]] * 2)

    def speeds(self, offsets: Array, dt: float) -> Array:
        """See ``Reach``: what is held follows at once."""
        distance = np.linalg.norm(offsets, axis=1, keepdims=True)
        wanted = np.minimum(self.gain * distance, self.fastest)
        return offsets * (wanted / np.maximum(distance, 1e-9))


class Inward(Objective):
    """Φ_f: each palm presses inward with a reference force.

    The force is a torque J^T f at the palm's middle (``force``); its rows only damp. A velocity,
    weighed by the inertia, would not be a pure force, and turn the palm onto its heel. Until both
    palms touch the one that does presses lightly: table friction holds the box against no more.

    Attributes:
        goal: force when both touch [N].
        force: force asked for at each palm, inward, shape (2,) [N].
        gaps: palms stay this far in front of the box's sides, shape (2,) [m]; below 0: go on until
            they touch.
        quick: palms go to ``BRAKES`` before the sides in the time of their ``glide``, and only from
            there on at the speed at which they may touch.
        glide: of the palms inward, while they touch nothing.

    Args:
        pad: stiffness of the palms [N/m]. While the force rises they go on by what their pads give
            way: held up by the damping instead, they would be turned onto an edge.
    """

    name = "force"
    BRAKES = 0.001
    """In front of the side where the box is believed to be a palm is slow [m]."""
    LIGHT = 5.0
    RAMP = 160.0
    SPEED, FAST, CLOSES = 0.08, 0.30, 6.0
    DAMPING = 0.0005
    CREEP = 0.01
    INTEGRAL, MOST = 4.0, 10.0
    LEAN, LEAN_RATE, LEAN_MOST = 300.0, 300.0, 8.0

    def __init__(self, pad: float) -> None:
        self._pad = pad
        self.goal = 25.0
        self.force = np.zeros(2)
        self.gaps = np.full(2, -1.0)
        self.quick = False
        self.glide = Glide((2,), self.FAST)
        self._middle: Array | None = None
        self._leaning = 0.0
        self._reference = np.zeros(2)
        self._integral = np.zeros(2)

    def reset(self) -> None:
        """Press no more."""
        self.glide.begin()
        self.force[:] = self._reference[:] = self._integral[:] = 0.0
        self.gaps[:] = -1.0
        self.keep(None)

    def error(self, kinematics: Any) -> Array:
        """Reference less measured force, shape (2,) [N]."""
        return np.asarray(self._reference - kinematics.feel.force)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Approach, or damping about the reference; sets ``force``."""
        scene: Scene = kinematics
        assert scene.box is not None
        n, feel = scene.box.across, scene.feel
        J, rate = [], []
        lean = self._lean(scene)
        approach = self._approach(scene, dt)
        for i, side in enumerate(SIDES):
            if feel.yielding[i]:
                self.force[i] = 0.0
                self.glide.stop(i)
                continue
            inward = -side * n
            J.append(inward @ scene.palms.J[i][:3])
            if not feel.touches[i]:
                self._reference[i] = self._integral[i] = self.force[i] = 0.0
                rate.append(approach[i])
                continue
            self.glide.stop(i)
            goal = self.goal if feel.both else self.LIGHT
            if self._reference[i] == 0.0:
                self._reference[i] = self.LIGHT
            step = self.RAMP * dt
            change = min(max(goal - self._reference[i], -step), step)
            self._reference[i] += change
            error = self._reference[i] - feel.force[i]
            integral = self._integral[i] + self.INTEGRAL * error * dt
            self._integral[i] = min(max(integral, -self.MOST), self.MOST)
            self.force[i] = self._reference[i] + self._integral[i] + side * lean
            damping = min(max(self.DAMPING * error, -self.CREEP), self.CREEP)
            rate.append(damping + change / dt / self._pad)
        return stack(J, rate)

    def keep(self, scene: Scene | None) -> None:
        """Keep the middle between the palms where it is in B from now on; None lets it go."""
        self._middle = None if scene is None else 0.5 * (scene.palms.p[0] + scene.palms.p[1])
        self._leaning = 0.0

    def _lean(self, scene: Scene) -> float:
        """Force by which the left palm presses more and the right one less [N].

        Two forces that only oppose each other leave what they hold free along their line.
        """
        if self._middle is None:
            return 0.0
        assert scene.box is not None
        n = scene.box.across
        off = float(n @ (0.5 * (scene.palms.p[0] + scene.palms.p[1]) - self._middle))
        total = self._leaning + self.LEAN_RATE * off * scene.dt
        self._leaning = min(max(total, -self.LEAN_MOST), self.LEAN_MOST)
        lean = self.LEAN * off + self._leaning
        return min(max(lean, -self.LEAN_MOST), self.LEAN_MOST)

    def _approach(self, scene: Scene, dt: float) -> Array:
        """Speeds inward of palms that touch nothing, shape (2,) [m/s]."""
        heel = Preshape.OPEN * float(scene.half_palm[2])  # nearer than the middle by this
        left = gaps(scene) - heel
        touches = scene.feel.touches
        if touches[0] != touches[1]:
            # the box's other side is where its width says, not where it was seen
            left[touches.index(False)] = scene.width - float(scene.size[1]) - 2.0 * heel
        way = np.full(2, self.glide.servo(self.SPEED))
        if self.quick:
            way = np.maximum(left - self.BRAKES, way)
        speed = self.glide.step(way, dt, self.SPEED)
        outside = np.clip(self.CLOSES * (left - self.gaps), -self.FAST, self.FAST)
        return np.where(self.gaps >= 0.0, np.minimum(speed, outside), speed)


def gaps(scene: Scene) -> Array:
    """Of the palms to the box's sides, along the line, shape (2,) [m]."""
    assert scene.box is not None
    box = scene.box
    out = np.array(SIDES) * ((np.array(scene.palms.p) - box.p) @ box.across)
    return np.asarray(out - 0.5 * float(box.size[1]) - float(scene.half_palm[1]))


class Flat(Objective):
    """Φ_m: turns each palm that touches until it feels no moment about the axes in its face."""

    name = "moment"
    gain = 0.25
    fastest = 0.4

    def error(self, kinematics: Any) -> Array:
        """Moments on the palms about x and z of P, shape (2, 2) [N m]."""
        return np.asarray(kinematics.feel.moment[:, [0, 2]])

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """With the moment."""
        scene: Scene = kinematics
        J, rate = [], []
        for i in range(2):
            if not scene.feel.touches[i]:
                continue
            R = scene.palms.R[i]
            for axis in (0, 2):
                J.append(R[:, axis] @ scene.palms.J[i][3:])
                wanted = self.gain * float(scene.feel.moment[i, axis])
                rate.append(min(max(wanted, -self.fastest), self.fastest))
        return stack(J, rate)


class Keep(Objective):
    """Turn about the palm's normal: none while the box stands, the captured angle once lifted."""

    name = "roll"
    gain = 12.0

    def __init__(self) -> None:
        self._captured: list[float] | None = None

    def capture(self, scene: Scene) -> None:
        """Hold the angles of now."""
        self._captured = [self._angle(scene, i) for i in range(2)]

    def release(self) -> None:
        """Hold still, at any angle."""
        self._captured = None

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """About the normal of each palm that touches."""
        scene: Scene = kinematics
        J, rate = [], []
        for i in range(2):
            if not scene.feel.touches[i]:
                continue
            J.append(scene.palms.R[i][:, 1] @ scene.palms.J[i][3:])
            held = self._captured
            rate.append(0.0 if held is None else self.gain * (held[i] - self._angle(scene, i)))
        return stack(J, rate)

    @staticmethod
    def _angle(scene: Scene, i: int) -> float:
        """Of x of P about y of P, from upright [rad]."""
        R = scene.palms.R[i]
        # about +y of P, z turns to x
        return math.atan2(float(R[2, 2]), float(R[2, 0]))


class Clearance(Objective):
    """Keeps the palms outside while they go around the box."""

    name = "clearance"
    FASTEST = 0.2

    def __init__(self) -> None:
        self.gaps = np.full(2, 0.05)
        self.glide = Glide((2,), self.FASTEST)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Along the line, to ``gaps`` [m] in front of the box's sides."""
        scene: Scene = kinematics
        assert scene.box is not None
        speed = self.glide.step(self.gaps - gaps(scene), dt)
        J, rate = [], []
        for i, side in enumerate(SIDES):
            if scene.feel.yielding[i]:
                self.glide.stop(i)
                continue
            J.append(side * scene.box.across @ scene.palms.J[i][:3])
            rate.append(float(speed[i]))
        return stack(J, rate)


class Preshape(Objective):
    """Palms upright beside the box, fingers ahead and a little open: heels touch first.

    Attributes:
        firm: palms that touch keep it as well; otherwise they are left to Φ_m.
    """

    name = "preshape"
    FASTEST = 1.2
    OPEN = 0.02
    """Of the fingers, outwards [rad]."""

    def __init__(self) -> None:
        self.firm = True
        self.glide = Glide((2, 3), self.FASTEST)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Turns of each palm towards its shape."""
        scene: Scene = kinematics
        assert scene.box is not None
        n, along = scene.box.across, scene.box.along
        c, s = math.cos(self.OPEN), math.sin(self.OPEN)
        turns = np.zeros((2, 3))
        for i, side in enumerate(SIDES):
            z = -(c * along + s * side * n)
            y = c * n - s * side * along
            E = scene.palms.R[i] @ np.array([np.cross(y, z), y, z])
            turns[i] = 0.5 * np.array([E[1, 2] - E[2, 1], E[2, 0] - E[0, 2], E[0, 1] - E[1, 0]])
        speed = self.glide.step(turns, dt)
        J, rate = [], []
        for i in range(2):
            if scene.feel.touches[i] and not self.firm:
                self.glide.stop(i)
                continue
            J.append(scene.palms.J[i][3:])
            rate.append(speed[i])
        if not J:
            return _NOTHING
        return Rows(np.concatenate(J), np.concatenate(rate))


class Ends(Objective):
    """Keeps every joint off its ends, above everything else: back to ``MARGIN`` from them.

    Args:
        lower, upper: ends of the joints, shape (14,) [rad].
    """

    name = "ends"
    gain = 4.0
    MARGIN = 0.08

    def __init__(self, lower: Array, upper: Array) -> None:
        self._lower, self._upper = lower + self.MARGIN, upper - self.MARGIN
        self._identity = np.eye(JOINTS)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Of the joints that are too near to an end."""
        q = kinematics.palms.q
        off = np.minimum(np.maximum(q, self._lower), self._upper) - q
        near = np.abs(off) > 1e-9
        if not near.any():
            return _NOTHING
        return Rows(self._identity[near], self.gain * off[near])


class Yield(Objective):
    """A palm pushed harder than ``limit`` goes where it is pushed, above everything else.

    Objectives along nearly the same direction pass such a palm over (``Feel.yielding``): both
    could be had, by a large motion across.

    Attributes:
        limit: [N].
    """

    name = "yield"
    gain = 0.02
    fastest = 1.5

    def __init__(self) -> None:
        self.limit = 50.0

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Along the force on each palm that is pushed too hard."""
        scene: Scene = kinematics
        J, rate = [], []
        for i in range(2):
            size = float(np.linalg.norm(scene.feel.pushed[i]))
            scene.feel.yielding[i] = size > self.limit
            if size > self.limit:
                way = scene.palms.R[i] @ (scene.feel.pushed[i] / size)
                J.append(way @ scene.palms.J[i][:3])
                rate.append(min(self.gain * (size - self.limit), self.fastest))
        return stack(J, rate)


class Rest(Objective):
    """Joints towards their posture at rest, with what freedom is left."""

    name = "posture"
    gain = 1.0
    fastest = 0.6

    def __init__(self, target: Array) -> None:
        self.target = target
        self._identity = np.eye(JOINTS)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """All joints."""
        rate = self.gain * (self.target - kinematics.palms.q)
        return Rows(self._identity, np.clip(rate, -self.fastest, self.fastest))
