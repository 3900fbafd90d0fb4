"""The observer over a recording, beside its baselines, and all that there is to say of it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from observer.metrics import chi2_band
from observer.observer import Observer, make_observer
from observer.observer_options import ObserverOptions
from observer.recordings.diagnosis import diagnose
from observer.recordings.facts import Diagnosis
from observer.recordings.innovations import Innovations, innovations, measurements
from observer.recordings.log import Log, Verdict
from observer.recordings.prepare import prepare
from observer.recordings.recording import Recording, Samples
from observer.recordings.run import Estimates, Track, collect, odometry_track, replay
from observer.recordings.score import Score, score
from observer.recordings.verdicts import verdicts
from observer.report import Limits

KINDS = ("ekf", "imm", "undelayed", "taylor", "hold")
"""Observers that a recording can be run through."""
BASELINES = ("hold", "taylor")
AT_ITS_STAMPS = "odometry at its stamps"
PICTURES = ("track", "innovations", "nis", "biases", "delay")
"""Names of the files that a report may have beside it."""
DOF = 3
"""Components of every innovation."""


@dataclass(frozen=True)
class Replayed:
    """What came of a recording.

    Attributes:
        recording: as read.
        used: as the observer was given it.
        diagnosis: of the recording as read.
        verdicts: in plain words, the worst first.
        kind: of the observer.
        estimates: what it said.
        tracks: by name: odometry at its stamps (as if it came at once), the observer, baselines.
        scores: of the tracks that overlap with the reference; empty without one.
        innovations: by sensor, of the filter with the observer's own margins.
    """

    recording: Recording
    used: Recording
    diagnosis: Diagnosis
    verdicts: list[Verdict]
    kind: str
    estimates: Estimates
    tracks: dict[str, Track]
    scores: dict[str, Score]
    innovations: dict[str, Innovations]


def replay_recording(recording: Recording, kind: str = "ekf", as_is: bool = False) -> Replayed:
    """Diagnose a recording, put it right, run the observer and its baselines over it, score them.

    Args:
        recording: as read.
        kind: one of ``KINDS``.
        as_is: run on the recording as it is, whatever the diagnosis.

    Raises:
        ValueError: unknown kind, or nothing that an observer could start from.
    """
    if kind not in KINDS:
        raise ValueError(f"no observer {kind!r} for a recording. Known: {', '.join(KINDS)}")
    diagnosis = diagnose(recording)
    used = recording if as_is else prepare(recording, diagnosis)
    tick = tick_of(used)
    # baselines know poses alone, whichever of the wheels' sensors the filter is given
    poses = used if used.odometry is not None else replace(used, odometry=recording.odometry)
    if kind in BASELINES and poses.odometry is None:
        raise ValueError(f"{kind} needs poses ([odometry]); {recording.name} has speeds alone")
    given = poses if kind in BASELINES else used
    estimates = collect(replay(given, observer_for(kind, given), tick))
    tracks: dict[str, Track] = {}
    raw = odometry_track(recording)
    if raw is not None:
        tracks[AT_ITS_STAMPS] = raw
    tracks[kind] = Track(estimates.t, estimates.pose)
    if raw is not None:
        for other in BASELINES:
            if other != kind:
                tracks[other] = collect(replay(poses, observer_for(other, poses), tick))
    reference = recording.reference
    scores: dict[str, Score] = {}
    if reference is not None:
        for name, track in tracks.items():
            try:
                scores[name] = score(track, reference)
            except ValueError:  # they do not overlap
                continue
    found = innovations(measurements(used), used.base)
    nis = {name: float(i.nis.mean()) for name, i in found.items()}
    said = verdicts_on(recording, diagnosis, nis)
    return Replayed(recording, used, diagnosis, said, kind, estimates, tracks, scores, found)


def verdicts_on(
    recording: Recording, diagnosis: Diagnosis, nis: Mapping[str, float] | None = None
) -> list[Verdict]:
    """All there is to say of a recording, findings of its reader among it, the worst first.

    Args:
        recording: as read.
        diagnosis: of it.
        nis: mean of a filter over it, by sensor, if one was run.
    """
    findings = recording.findings if isinstance(recording, Log) else ()
    return verdicts(diagnosis, findings, nis)


def observer_for(kind: str, recording: Recording) -> Observer:
    """An observer that calls a sensor late or silent only beyond what is usual in the recording."""
    limits = Limits()
    limits = replace(
        limits,
        imu_late=max(limits.imu_late, _usual_age(recording.imu)),
        odometry_late=max(limits.odometry_late, _usual_age(recording.odometry or recording.speeds)),
    )
    return make_observer(kind, recording.base, options=ObserverOptions(limits=limits))


def _usual_age(samples: Samples | None) -> float:
    """Age that a sensor's newest sample has at most, pauses aside: delay and 3 periods [s]."""
    if samples is None or len(samples) < 2:
        return 0.0
    return float(np.median(samples.arrival - samples.t)) + 3.0 * samples.period


def tick_of(recording: Recording) -> float:
    """Time between two estimates [s]: a fifth of the fastest sensor's period, 2 to 20 ms."""
    sensors = (recording.odometry, recording.speeds, recording.imu)
    periods = [s.period for s in sensors if s is not None and len(s) > 1]
    return 1e-3 * min(max(round(200.0 * min(periods, default=0.0)), 2), 20)


def band_of(count: int) -> tuple[float, float]:
    """Where the mean of so many NIS lies in 95 % of all cases, if the filter is right."""
    return chi2_band(DOF, max(count, 1))


# -- as data ---------------------------------------------------------------------------------


def data_of(done: Replayed) -> dict[str, Any]:
    """Everything as plain data, for scripts; units are in the names, what is not known is null."""
    e = done.estimates
    out = {
        "name": done.recording.name,
        "observer": done.kind,
        "as_is": done.used is done.recording,
        "seconds": float(e.t[-1] - e.t[0]),
        "sensors": {name: asdict(t) for name, t in done.diagnosis.timing.items()},
        "verdicts": [asdict(v) for v in done.verdicts],
        "uses": done.diagnosis.use,
        "scores": [
            {
                "track": name,
                "position_rms_m": s.position_rms,
                "position_max_m": s.position_max,
                "heading_rms_rad": s.heading_rms,
                "relative": [
                    {"span_s": r.span, "position_rms_m": r.position, "heading_rms_rad": r.heading}
                    for r in s.relative
                ],
                "instants": s.instants,
            }
            for name, s in done.scores.items()
        ],
        "reference_sigma_m": done.recording.reference_sigma,
        "consistency": {
            name: {
                "innovations": len(i),
                "nis_mean": float(i.nis.mean()),
                "nis_expected": DOF,
                "nis_band": list(band_of(len(i))),
                "refused": int(i.refused.sum()),
            }
            for name, i in done.innovations.items()
        },
        "dead_reckoned": done.used.odometry is None and done.kind not in BASELINES,
        "valid_share": float(e.valid.mean()),
        "slip_share": float(e.slip.mean()),
        "said": said_of(e),
        "rejected": e.rejected,
        "base": done.used.base.model_dump(include={"platform", "odometry", "imu"}),
    }
    plain: dict[str, Any] = finite(out)
    return plain


def said_of(estimates: Estimates) -> dict[str, float]:
    """What was said beside the estimates, with the share of time, the most frequent first."""
    count: Counter[str] = Counter()
    for reason in estimates.reason:
        count.update({part.split(":")[0] for part in reason.split("; ") if part})
    return {text: n / len(estimates) for text, n in count.most_common()}


def finite(value: Any) -> Any:
    """The same, with null for numbers that JSON does not know."""
    if isinstance(value, dict):
        return {k: finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(v) for v in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value


def in_unit(values: Sequence[float]) -> tuple[float, str]:
    """Factor and name of the unit in which lengths [m] read best."""
    known = [v for v in values if math.isfinite(v)]
    return (1e3, "mm") if known and max(known) < 0.1 else (1.0, "m")
