"""Where a log comes from: scenario, seed, versions."""

from __future__ import annotations

import hashlib
import platform
from importlib import metadata

from sim.scenario import Scenario


def provenance(scenario: Scenario, seed: int, observer: str) -> dict[str, str]:
    """What a log must say about where it came from."""
    text = scenario.path.read_text(encoding="utf-8") if scenario.path.is_file() else ""
    packages = ("steadyhand", "numpy", "dartpy", "filterpy", "eclipse-zenoh")
    return {
        "scenario": scenario.name,
        "scenario_sha256": hashlib.sha256(text.encode()).hexdigest(),
        "scenario_toml": text,
        "seed": str(seed),
        "observer": observer,
        "python": platform.python_version(),
    } | {name: metadata.version(name) for name in packages}
