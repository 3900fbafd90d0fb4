"""From a log to noise parameters, and to the lines of a robot's description that state them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

from deploy.robot import MobileBase
from observer.recordings.diagnosis import diagnose
from observer.recordings.facts import Diagnosis
from observer.recordings.log import Log, Verdict
from observer.recordings.prepare import prepare
from observer.recordings.recording import Recording
from observer.recordings.run import Track, collect, replay
from observer.recordings.score import score
from observer.recordings.tune import Tuning, tune
from services.replays.run import finite, observer_for, tick_of, verdicts_on

FROM_GYRO = ("odometry.speed_noise heading",)
"""Stays as the diagnosis set it where the gyro is to give the heading: wheels that turn too far do
so steadily, which the likelihood would take for exact."""


@dataclass(frozen=True)
class Report:
    """What came of tuning.

    Attributes:
        recording: as read.
        used: as tuned on, with what is known of the platform before.
        verdicts: on the recording, the worst first.
        tuning: parameters before and after.
        scores: distance from the reference over the whole log, root mean square, before and after
            [m], with the observer's own margins; None without a reference.
    """

    recording: Recording
    used: Recording
    verdicts: list[Verdict]
    tuning: Tuning
    scores: tuple[float, float] | None


def tune_recording(recording: Recording, seconds: float) -> Report:
    """Diagnose a recording, put it right, find its noise, and see what that does to the estimate.

    Raises:
        ValueError: too little to tune by.
    """
    diagnosis = diagnose(recording)
    used = prepare(recording, diagnosis)
    tuning = tune(used, seconds, keep=FROM_GYRO if by_gyro(diagnosis) else ())
    said = verdicts_on(recording, diagnosis)
    scores = None
    if used.reference is not None:
        scores = _error(used, used.base), _error(used, tuning.base)
    return Report(recording, used, said, tuning, scores)


def by_gyro(diagnosis: Diagnosis) -> bool:
    """Whether the heading is the gyro's because the wheels' is not to be trusted."""
    return diagnosis.use == "speed" and diagnosis.wheels is not None


def _error(recording: Recording, base: MobileBase) -> float:
    run = collect(
        replay(recording, observer_for("ekf", replace(recording, base=base)), tick_of(recording))
    )
    assert recording.reference is not None
    return score(Track(run.t, run.pose), recording.reference).position_rms


def fragment(report: Report) -> str:
    """The lines that state what was found, for robot.toml or a recording in the plain form.

    That one has the same keys but for the noise of speeds; for speeds made of poses it has none.
    """
    base = report.tuning.base
    found: dict[str, dict[str, bool]] = {}
    for x in report.tuning.tuned:
        table, key = x.parameter.name.split(" ")[0].split(".")
        keys = found.setdefault(table, {})
        keys[key] = keys.get(key, False) or x.told
    lines = [f"# likeliest on {report.recording.name} (steadyhand tune)"]
    plain = isinstance(report.recording, Log)
    if plain:
        lines.append("# add the lines to the tables of the recording's TOML")
    untold = [
        f"[{table}] {k}" for table, keys in found.items() for k, told in keys.items() if not told
    ]
    if untold:
        lines.append(f"# not told by this log: {', '.join(untold)}")
    for table in ("platform", "odometry", "imu"):
        told = [key for key, is_told in found.get(table, {}).items() if is_told]
        stated = {key: f"{key} = {_toml(getattr(getattr(base, table), key))}" for key in told}
        speed = stated.pop("speed_noise", "") if plain else ""
        if stated:
            lines += ["", f"[{table}]", *stated.values()]
        if speed and report.recording.odometry is None:
            lines += ["", "[speeds]", speed.removeprefix("speed_")]
        elif speed:
            lines += ["", f"# of speeds made of poses, always estimated: {speed}"]
    return "\n".join(lines) + "\n"


def _toml(value: float | tuple[float, ...]) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(f"{v:.4g}" for v in value) + "]"
    return f"{value:.4g}"


def data_of(report: Report) -> dict[str, Any]:
    """Everything as plain data, for scripts."""
    t = report.tuning
    out = {
        "name": report.recording.name,
        "span_s": list(t.span),
        "innovations": t.innovations,
        "parameters": [
            {
                "name": x.parameter.name,
                "unit": x.parameter.unit,
                "before": x.before,
                "after": x.after,
                "deviation": x.deviation,
                "told": x.told,
            }
            for x in t.tuned
        ],
        "log_likelihood": list(t.log_likelihood),
        "nis": {name: list(pair) for name, pair in t.nis.items()},
        "position_rms_m": None if report.scores is None else list(report.scores),
        "verdicts": [asdict(v) for v in report.verdicts],
        "toml": fragment(report),
    }
    plain: dict[str, Any] = finite(out)
    return plain
