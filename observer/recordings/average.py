"""Whether a yaw rate is an average over the past, and over how long.

Some drivers publish not the present speed but the mean over a second. Its stamps look fresh; its
content is half a second old and smeared. The rate is compared with what the gyro or the pose turned
over a box: ``rate(t) = scale * (T(t - d) - T(t - d - box)) / box + constant``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from observer.recordings.delay import EARLIEST, LATEST, SURE
from observer.recordings.figure import Figure, untold
from observer.recordings.increments import Noise, Turns, of_rate, regress
from observer.recordings.series import Curve, touches
from services.messages import Array

LONGEST = 2.0
"""Box that is looked for [s]."""
BOX_STEP, SHIFT_STEP = 0.1, 0.04
BETTER = 0.7
"""An average must leave less than this share of the squares that a plain delay leaves."""
SHARPER = 0.02
"""Step of the refined box and shift for which the rise of the cost is looked at [s]."""


@dataclass(frozen=True)
class Average:
    """A yaw rate as the mean of a turn.

    Attributes:
        box: over how long it is averaged [s]; 0 where a plain delay says as much.
        delay: age of the middle of the box, by the stamps [s].
    """

    box: Figure
    delay: Figure


def fit_average(t: Array, rate: Array, turned: Curve, holes: list[tuple[float, float]]) -> Average:
    """Find box and delay of a yaw rate.

    Args:
        t: stamps (n,) [s].
        rate: (n,) [rad/s].
        turned: heading by gyro or pose [rad].
        holes: gaps of that (start, end) [s].
    """
    h = float(np.median(np.diff(t)))
    first, last = t - LATEST - LONGEST / 2.0, t - EARLIEST + LONGEST / 2.0
    good = (first >= turned.start) & (last <= turned.end) & ~touches(first, last, holes)
    t, rate = t[good], rate[good]
    if len(t) < 50 or float(np.std(rate)) < 1e-3:
        none = untold("too little motion")
        return Average(none, none)

    def squares(box: float, middle: float) -> float:
        """Mean square [rad^2/s^2]."""
        turns: Turns = of_rate(t, rate, box, -box / 2.0)
        fit = regress(turns, turned, middle, Noise(0.0, 1.0))
        return float(np.mean((fit.residual / box) ** 2))

    middles = np.arange(EARLIEST, LATEST, SHIFT_STEP)
    plain = min((squares(h, m), float(m)) for m in middles)
    boxes = np.arange(BOX_STEP, LONGEST + BOX_STEP, BOX_STEP)
    boxes = boxes[boxes > 1.5 * h]
    _, box, middle = min((squares(b, m), float(b), float(m)) for b in boxes for m in middles)
    found = minimize(
        lambda p: squares(max(p[0], h), p[1]),
        [box, middle],
        method="Nelder-Mead",
        options={"xatol": 1e-4, "fatol": 1e-12, "initial_simplex": _around(box, middle)},
    )
    box, middle = max(float(found.x[0]), h), float(found.x[1])
    least = squares(box, middle)
    sharp = minimize(
        lambda m: squares(h, m[0]), [plain[1]], method="Nelder-Mead", options={"xatol": 1e-4}
    )
    surely = regress(of_rate(t, rate, box, -box / 2.0), turned, middle, Noise(0.0, 1.0))
    if not surely.scale > SURE * surely.scale_sigma:
        none = untold("too little turning")
        return Average(none, none)
    plain_at = float(sharp.x[0])
    if least > BETTER * squares(h, plain_at) or box < 2.0 * h:
        return Average(
            box=Figure(0.0),
            delay=Figure(plain_at, _sigma(lambda m: squares(h, m), plain_at, len(t))),
        )
    return Average(
        box=Figure(box, _sigma(lambda b: squares(b, middle), box, len(t))),
        delay=Figure(middle, _sigma(lambda m: squares(box, m), middle, len(t))),
    )


def _around(box: float, middle: float) -> Array:
    return np.array(
        [[box, middle], [box + BOX_STEP / 2, middle], [box, middle + SHIFT_STEP / 2]],
        dtype=np.float64,
    )


def _sigma(cost: Callable[[float], float], at: float, n: int) -> float:
    """Standard deviation from how fast a mean square rises about its least value."""
    low, middle, high = cost(at - SHARPER), cost(at), cost(at + SHARPER)
    curvature = (low - 2.0 * middle + high) / SHARPER**2
    return float(np.sqrt(2.0 * middle / n / curvature)) if curvature > 0.0 else float("nan")
