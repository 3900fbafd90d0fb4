"""What the page says in words: the automaton, the votes, the services, as Markdown."""

from __future__ import annotations

import numpy as np

from services.console.feed import Feed
from services.console.overlays import vote_colour
from services.topics import ARM_STATUS, BASE_STATUS, BOARD, ESTIMATE, HEALTH, TRUTH

SILENT = 1.5
"""A service not heard for this long is called silent [s]."""
WARNING = (
    "**No safety stop.** What is pressed here is a request over a network, which may come late or "
    "not at all. Keep the robot's own emergency stop within reach."
)

WAITING = (
    "**Waiting for a robot.** Nobody has said yet which scenario runs. `steadyhand up` starts one; "
    "this page then goes on by itself."
)


def automaton(feed: Feed) -> str:
    """Program, node and the last events."""
    arm = feed.latest(ARM_STATUS)
    lines = []
    if arm is None:
        lines.append("The arm has not spoken yet.")
    else:
        lines.append(f"**{arm.state}**" + (f": {plain(arm.reason)}" if arm.reason else ""))
        if arm.program:
            node = f", node **{plain(arm.node)}**" if arm.node else ""
            lines.append(f"program {plain(arm.program)}{node}, transition {arm.transitions}")
    lines.append("")
    lines += [f"- {t:.2f} s: {plain(text)}" for t, text in reversed(feed.events)]
    return "\n".join(lines)


def platform(feed: Feed) -> str:
    """State of the platform, and every behaviour's vote with the colour of its arrow."""
    base = feed.latest(BASE_STATUS)
    if base is None:
        return "The platform's behaviours have not spoken yet."
    reason = f": {plain(base.reason)}" if base.reason else ""
    rows = [f"**{base.state}**{reason}", "", "| vote | vx | vy | turn | weight |", "|-|-|-|-|-|"]
    for name, vote in base.votes.items():
        r, g, b = vote_colour(name)
        dot = f'<span style="color:rgb({r},{g},{b})">●</span>'
        rows.append(f"| {dot} {plain(name)} | " + " | ".join(f"{v:+.3f}" for v in vote) + " |")
    rows.append("| ● chosen | " + " | ".join(f"{v:+.3f}" for v in base.chosen) + " | |")
    return "\n".join(rows)


def estimate(feed: Feed) -> str:
    """What the observer believes, and how wrong it is where that is known."""
    e = feed.latest(ESTIMATE)
    if e is None:
        return "The observer has not spoken yet."
    sigma = np.sqrt(np.maximum(np.diag(e.covariance)[:3], 0.0)) * 1e3
    usable = (
        " ".join(["usable", plain(e.reason)]).strip()
        if e.valid
        else f"**not usable: {plain(e.reason)}**"
    )
    scaled = e.pose * 1e3
    lines = [
        f"{usable}, {e.mode}",
        "",
        f"x {scaled[0]:+.1f} ± {sigma[0]:.1f} mm, y {scaled[1]:+.1f} ± {sigma[1]:.1f} mm, "
        f"heading {np.degrees(e.pose[2]):+.2f}° ± {np.degrees(sigma[2] / 1e3):.2f}°",
    ]
    truth, board = feed.latest(TRUTH), feed.latest(BOARD)
    if truth is not None:
        acting = ", ".join(map(plain, truth.disturbances)) or "none"
        lines += ["", f"disturbances acting: **{acting}**"]
    if board is not None:
        lines += ["", f"wheels read {board.wheel_scale:.4f} of the way"]
    return "\n".join(lines)


def services(feed: Feed, now: float) -> str:
    """A row for each service: state, rate, lateness, overruns, restarts."""
    rows = ["| service | state | Hz | p99 late | missed | restarts |", "|-|-|-|-|-|-|"]
    notes = []
    for name in HEALTH:
        seen = feed.services.get(name)
        if seen is None:
            rows.append(f"| {name} | *not heard* | | | | |")
            continue
        h, silent = seen.health, now - seen.at
        mean = h.period.get("mean", 0.0)
        state = f"**silent for {silent:.0f} s**" if silent > SILENT else plain(h.state)
        rows.append(
            f"| {name} | {state} | {1 / mean if mean else 0:.0f} | "
            f"{h.lateness.get('p99', 0.0) * 1e3:.2f} ms | {h.overruns} | {h.restarts} |"
        )
        if h.detail:
            notes.append(f"- {name}: {plain(h.detail)}")
        if h.refused:
            refused = ", ".join(f"{plain(k)} {v}" for k, v in h.refused.items())
            notes.append(f"- {name} refused {refused}")
    return "\n".join([*rows, "", *notes])


def plain(text: str) -> str:
    """Text that a reader of Markdown shows as it is."""
    for sign in "\\`*_{}[]<>|#":
        text = text.replace(sign, "\\" + sign)
    return text.replace("\n", " ")
