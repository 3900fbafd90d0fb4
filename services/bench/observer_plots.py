"""Pictures of the observer's benchmark."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from observer.bench.estimators import ESTIMATORS
from observer.bench.motions import MOTIONS, START
from observer.bench.play import Track
from observer.bench.rows import Key, Row, nees_over_time
from observer.bench.score import AFTERMATH, BINS, Score
from observer.bench.world import PUSH_TIME, World
from observer.metrics import chi2_band
from services.bench.observer import Plan
from services.reports.style import plt, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {
    "ekf": "#1f4e9c",
    "exact": "#2e7d32",
    "exact_smooth": "#7fbf7b",
    "smoother": "#8bc34a",
    "hold": "#777777",
    "taylor1": "#e08a1e",
    "taylor2": "#c2571a",
    "taylor3": "#7a3b12",
    "undelayed": "#b3261e",
    "single": "#7e57c2",
    "imm": "#26a6a6",
}


def write_plots(
    folder: Path, scores: Mapping[Key, Score], rows: Sequence[Row], plan: Plan
) -> list[Path]:
    """Draw every picture of which the motions and estimators were run; returns the files.

    Args:
        folder: made if need be.
        scores: as measured.
        rows: of the table.
        plan: what was run. Pictures of one run are of its first seed and rate.
    """
    rate = plan.rates[0]
    drawn: dict[str, Figure] = {}
    run = plan.all_estimators
    if "sway" in plan.motions:
        names = [n for n in ("ekf", "exact", "taylor1", "hold") if n in run]
        drawn["sway_error"] = one_run(MOTIONS["sway"].world(plan.seed, rate), names)
    if "push" in plan.motions:
        some = [n for n in ("ekf", "single", "exact") if n in run]
        drawn["push"] = one_push(MOTIONS["push"].world(plan.seed, rate), some)
    drawn["rms"] = bars(rows, rate)
    steps = {k: s for k, s in scores.items() if k.odometry_hz == rate and "step counts" in s.sums}
    if steps:
        drawn["steps"] = step_histogram(steps)
    shown = [m for m in ("sway", "drive", "standing") if m in plan.motions]
    if shown:
        drawn["nees"] = consistency(scores, shown, rate, plan.runs)
    folder.mkdir(parents=True, exist_ok=True)
    return save(folder, ((f"observer_{name}", figure) for name, figure in drawn.items()))


def one_run(world: World, names: Sequence[str]) -> Figure:
    """Error over time of several estimators; of the first also what it says of itself."""
    figure, axes = plt.subplots(3, 1, figsize=(9, 7.5), sharex=True, layout="constrained")
    tracks = {name: ESTIMATORS[name].follow(world) for name in names}
    part = (world.t >= START) & (world.t < START + 10.0)
    units = (("x [mm]", 1e3), ("y [mm]", 1e3), ("heading [deg]", np.degrees(1.0)))
    for i, (axis, (label, unit)) in enumerate(zip(axes, units, strict=True)):
        # whoever is far off leaves the picture; the product and the reference set the scale
        for k, name in enumerate(names):
            error = unit * (tracks[name].pose - world.reference)[part, i]
            axis.plot(
                world.t[part], error, color=COLOURS[name], lw=_width(name), label=name, zorder=9 - k
            )
        first = tracks[names[0]]
        sigma = unit * 3.0 * np.sqrt(first.covariance[part, i, i])
        axis.fill_between(
            world.t[part], -sigma, sigma, color=COLOURS[names[0]], alpha=0.12, lw=0,
            label=f"3 sigma of {names[0]}",
        )  # fmt: skip
        axis.set_ylim(*(np.array([-1, 1]) * 2.0 * float(np.max(sigma))))
        axis.set_xlim(START, START + 10.0)
        axis.set_ylabel(f"error of {label}")
    axes[0].legend(ncols=len(names) + 1, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    axes[-1].set_xlabel("time [s]")
    figure.suptitle(f"Sway, odometry {world.robot.odometry.rate:g} Hz: error over time")
    return figure


def _width(name: str) -> float:
    return {"ekf": 1.6, "hold": 0.5, "taylor1": 0.7}.get(name, 1.0)


def one_push(world: World, names: Sequence[str]) -> Figure:
    """A push: the true velocity, and the errors around it."""
    start = world.conditions.pushes[0]
    part = (world.t >= start - 0.3) & (world.t < start + 1.2)
    t = 1e3 * (world.t[part] - start)
    figure, (top, middle, low) = plt.subplots(
        3, 1, figsize=(9, 7.5), sharex=True, layout="constrained"
    )
    tracks: dict[str, Track] = {n: ESTIMATORS[n].follow(world) for n in names}
    top.plot(t, 1e3 * world.velocity[part, 0], color="black", lw=1.2, label="vx, true")
    top.plot(t, 1e3 * world.velocity[part, 1], color="black", lw=1.2, ls="--", label="vy, true")
    top.set_ylabel("velocity in O [mm/s]")
    for name, track in tracks.items():
        e = 1e3 * (track.pose - world.reference)[part]
        v = 1e3 * (track.velocity - world.velocity)[part]
        middle.plot(t, np.hypot(e[:, 0], e[:, 1]), color=COLOURS[name], lw=_width(name), label=name)
        low.plot(t, np.hypot(v[:, 0], v[:, 1]), color=COLOURS[name], lw=_width(name))
    middle.set_ylabel("position error [mm]")
    low.set_ylabel("velocity error [mm/s]")
    low.set_xlabel("time from the start of the push [ms]")
    for axis, label in ((top, "push"), (middle, None), (low, None)):
        axis.axvspan(0.0, 1e3 * PUSH_TIME, color="#b3261e", alpha=0.10, lw=0, label=label)
        axis.set_xlim(t[0], t[-1])
    middle.axvspan(
        1e3 * PUSH_TIME,
        1e3 * (PUSH_TIME + AFTERMATH),
        color="#b3261e",
        alpha=0.04,
        lw=0,
        label="still counts as in the push",
    )
    top.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    middle.legend(ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    figure.suptitle("A push of 200 N on 190 kg for 0.2 s, odometry "
                    f"{world.robot.odometry.rate:g} Hz")  # fmt: skip
    return figure


def bars(rows: Sequence[Row], rate: float) -> Figure:
    """RMS error by estimator and motion."""
    mine = [r for r in rows if r["odometry_hz"] == rate]
    motions = list(dict.fromkeys(r["motion"] for r in mine))
    names = list(dict.fromkeys(r["estimator"] for r in mine))
    figure, axes = plt.subplots(2, 1, figsize=(11, 7), sharex=True, layout="constrained")
    width = 0.84 / len(names)
    for axis, field, label in zip(
        axes, ("rms_mm", "rms_deg"), ("position error, rms [mm]", "heading error, rms [deg]"),
        strict=True,
    ):  # fmt: skip
        for k, name in enumerate(names):
            value = {r["motion"]: r[field] for r in mine if r["estimator"] == name}
            at = np.arange(len(motions)) + (k - 0.5 * (len(names) - 1)) * width
            axis.bar(at, [value[m] for m in motions], width, color=COLOURS[name], label=name)
        axis.set_yscale("log")
        axis.set_ylim(0.6 * min(r[field] for r in mine), None)
        axis.yaxis.set_major_formatter("{x:g}")
        axis.yaxis.set_minor_formatter(sparse)
        axis.set_ylabel(label)
        axis.grid(axis="x", visible=False)
    axes[1].set_xticks(np.arange(len(motions)), motions)
    axes[0].legend(ncols=len(names), loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=8)
    figure.suptitle(f"Error by motion, odometry {rate:g} Hz, {mine[0]['runs']} runs (log scale)")
    return figure


def sparse(value: float, position: int | None = None) -> str:
    """Label of a tick between powers of ten: only 2 and 5 have room."""
    digit = f"{value:.0e}"[0]
    return f"{value:g}" if digit in "25" else ""


def step_histogram(scores: Mapping[Key, Score]) -> Figure:
    """How often the pose changes by how much beyond the true motion, in a millisecond."""
    names = [n for n in ("ekf", "exact", "taylor1") if any(k.estimator == n for k in scores)]
    figure, axis = plt.subplots(figsize=(9, 4.5), layout="constrained")
    labels = {"exact": "exact, without output stage"}
    for name in names:
        some = [
            s.sums["step counts"]
            for k, s in scores.items()
            if k.estimator == name and k.motion not in ("slip", "dropout")
        ]
        if not some:
            continue
        counts = np.sum(some, axis=0)
        axis.stairs(
            counts / np.sum(counts), BINS, color=COLOURS[name], lw=1.4, label=labels.get(name, name)
        )
    axis.axvline(0.02, color="black", lw=1.0, ls=":", label="goal: 0.02, in a push 0.035")
    axis.axvline(0.035, color="black", lw=1.0, ls=":")
    axis.set_yscale("log")
    axis.set_xlim(0.0, BINS[-1])
    axis.set_xlabel("step beyond the true motion [mm/ms]; the last bin holds all that is larger")
    axis.set_ylabel("share of milliseconds")
    axis.legend()
    axis.set_title("Steps of the estimated position, all motions but slip and dropout")
    return figure


def consistency(
    scores: Mapping[Key, Score], motions: Sequence[str], rate: float, runs: int
) -> Figure:
    """NEES of the pose over time, mean over the runs, with the band in which it should lie."""
    figure, axes = plt.subplots(
        len(motions), 1, figsize=(9, 2.4 * len(motions) + 0.8), sharex=True, layout="constrained",
        squeeze=False,
    )  # fmt: skip
    low, high = chi2_band(3, runs)
    for axis, motion in zip(axes[:, 0], motions, strict=True):
        top = 0.0
        for name in ("exact", "ekf"):
            score = scores.get(Key(motion, rate, name))
            if score is not None:
                t, values = nees_over_time(score)
                top = max(top, float(np.max(values)))
                axis.plot(t + START, values, color=COLOURS[name], lw=_width(name), label=name)
        _band(axis, low, high, f"95 % band of {runs} runs")
        axis.set_ylabel(f"{motion}: NEES")
        axis.set_yscale("log")
        axis.set_yticks((1, 2, 3, 5, 10, 20, 50))
        axis.yaxis.set_major_formatter("{x:g}")
        axis.minorticks_off()
        axis.set_ylim(min(1.0, 0.8 * low), max(10.0, 1.2 * top))
        axis.set_xlim(START, None)
    axes[0, 0].legend(loc="lower center", ncols=3, bbox_to_anchor=(0.5, 1.0))
    axes[-1, 0].set_xlabel("time [s]")
    figure.suptitle(f"Does the covariance tell the truth? Odometry {rate:g} Hz")
    return figure


def _band(axis: Axes, low: float, high: float, label: str) -> None:
    axis.axhspan(low, high, color="black", alpha=0.10, lw=0, label=label)
    axis.axhline(3.0, color="black", lw=0.7)
