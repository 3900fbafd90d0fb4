"""How near a track is to the reference: one rigid alignment, absolute and relative errors.

The frames of odometry and reference have nothing to do with each other, so the track is laid onto
the reference as one stiff piece (Umeyama's method without scale). The absolute error that remains
depends on *when* a track goes wrong; relative errors, of the motion within some seconds, do not,
and are what matters to an arm (Sturm et al., IROS 2012; Zhang and Scaramuzza, IROS 2018).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from observer.metrics import rms
from observer.recordings.recording import Samples
from observer.recordings.run import Track
from services.messages import Array

SPANS = (1.0, 10.0)
"""Durations over which relative errors are taken [s]."""
STANDS = 0.01
"""What moves by less than this, rms, stands [m]."""


@dataclass(frozen=True)
class Alignment:
    """A rigid motion of the plane.

    Attributes:
        angle: by which it turns [rad].
        shift: by which it then moves (2) [m].
    """

    angle: float
    shift: Array

    def apply(self, pose: Array) -> Array:
        """Poses (n, 3), or points (n, 2), moved."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        out = np.array(pose, dtype=np.float64)
        out[:, :2] = out[:, :2] @ np.array([[c, s], [-s, c]]) + self.shift
        if out.shape[1] == 3:
            out[:, 2] += self.angle
        return out


def align(points: Array, reference: Array) -> Alignment:
    """The rigid motion that brings points nearest to others, in the mean square.

    Of what hardly moved no direction can be told: it is shifted and not turned.

    Args:
        points: (n, 2) [m].
        reference: (n, 2) [m], row by row.

    Raises:
        ValueError: fewer than two points.
    """
    if len(points) < 2:
        raise ValueError(f"{len(points)} common points; an alignment takes at least 2")
    a, b = points - points.mean(axis=0), reference - reference.mean(axis=0)
    cross = float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())
    moved = min(float(np.sqrt((x * x).sum(axis=1).mean())) for x in (a, b)) > STANDS
    angle = math.atan2(cross, float((a * b).sum())) if moved else 0.0
    turned = Alignment(angle, np.zeros(2)).apply(points.mean(axis=0, keepdims=True))[0]
    return Alignment(angle, reference.mean(axis=0) - turned)


@dataclass(frozen=True)
class Relative:
    """Error of the motion within ``span`` seconds; nan where the reference has no heading."""

    span: float
    position: float
    """Root mean square [m]."""
    heading: float
    """Root mean square [rad]."""


@dataclass(frozen=True)
class Score:
    """A track against a reference.

    Attributes:
        alignment: of the track onto the reference.
        position_rms: absolute error [m].
        position_max: likewise, the largest [m].
        heading_rms: [rad]; nan if the reference has no heading.
        relative: by span.
        instants: at which they were compared.
    """

    alignment: Alignment
    position_rms: float
    position_max: float
    heading_rms: float
    relative: tuple[Relative, ...]
    instants: int


def score(track: Track, reference: Samples, spans: Sequence[float] = SPANS) -> Score:
    """Compare a track with a reference at the reference's instants.

    The track is interpolated linearly; instants outside it, or in a gap of more than 1 s, are left
    out.

    Args:
        track: X_OB over time.
        reference: values (n, 2) or (n, 3), in any frame.
        spans: durations for relative errors [s].

    Raises:
        ValueError: fewer than two instants in common.
    """
    t, mine, true = matched(track, reference)
    alignment = align(mine[:, :2], true[:, :2])
    error = alignment.apply(mine)[:, : true.shape[1]] - true
    far = np.hypot(error[:, 0], error[:, 1])
    heading = math.nan
    if true.shape[1] == 3:
        error[:, 2] = np.angle(np.exp(1j * error[:, 2]))
        heading = rms(error[:, 2])
    moved = alignment.apply(mine)
    relative = tuple(_relative(t, moved, true, span) for span in spans)
    return Score(alignment, rms(far), float(far.max()), heading, relative, len(t))


def matched(track: Track, reference: Samples) -> tuple[Array, Array, Array]:
    """Instants (n,), track (n, 3) and reference (n, k) where both are known."""
    if len(track) < 2:
        return np.zeros(0), np.zeros((0, 3)), reference.values[:0]
    i = np.clip(np.searchsorted(track.t, reference.t, side="right"), 1, len(track) - 1)
    inside = (reference.t >= track.t[0]) & (reference.t <= track.t[-1])
    inside &= track.t[i] - track.t[i - 1] <= 1.0
    t = reference.t[inside]
    columns = [np.interp(t, track.t, column) for column in track.pose.T]
    return t, np.stack(columns, axis=1), reference.values[inside]


def _relative(t: Array, mine: Array, true: Array, span: float) -> Relative:
    """Over all pairs of instants ``span`` apart, to a fifth of it.

    With a heading in the reference, each motion is seen from the platform at its start, so that an
    error made before it does not count. Without one, both are seen in the aligned frame.
    """
    j = np.searchsorted(t, t + span - 1e-9)
    i = np.flatnonzero(j < len(t))
    i = i[np.abs(t[j[i]] - t[i] - span) <= 0.2 * span]
    if not len(i):
        return Relative(span, math.nan, math.nan)
    j = j[i]
    a, b = mine[j, :2] - mine[i, :2], true[j, :2] - true[i, :2]
    if true.shape[1] == 2:
        return Relative(span, rms(a - b), math.nan)
    error = _seen_from(a, mine[i, 2]) - _seen_from(b, true[i, 2])
    turn = np.angle(np.exp(1j * (mine[j, 2] - mine[i, 2] - true[j, 2] + true[i, 2])))
    return Relative(span, rms(error), rms(turn))


def _seen_from(way: Array, heading: Array) -> Array:
    c, s = np.cos(heading), np.sin(heading)
    return np.stack([c * way[:, 0] + s * way[:, 1], c * way[:, 1] - s * way[:, 0]], axis=1)
