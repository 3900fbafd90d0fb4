"""Knobs of the filter, each with what it does and in which unit."""

from __future__ import annotations

from dataclasses import dataclass

ODOMETRY_UPDATES = ("interval", "gaussian")
MODES = ("switch", "imm", "single")


@dataclass(frozen=True)
class FilterOptions:
    """Knobs of the filter; the defaults were chosen on many seeds, see docs/observer.md."""

    odometry_update: str = "interval"
    """``interval`` (the value was rounded) or ``gaussian`` (R = q^2/12)."""
    history: float = 0.5
    """Measurements this much older than the newest can still be fused [s]."""
    gap: float = 5.0
    """After this long without any measurement the filter starts afresh, keeping its biases [s]."""
    future: float = 0.001
    """A stamp this far ahead of now is refused [s]."""
    odometry_gate: float = 25.0
    """Largest NIS (3 degrees of freedom) of odometry that is believed."""
    imu_gate: float = 60.0
    """The same of the IMU, after the disturbance was raised: only nonsense fails."""
    alert_nis: float = 30.0
    """NIS of the IMU that means: something pushes."""
    alert_factor: float = 150.0
    """Factor on the variance of the disturbance from then on ..."""
    alert_time: float = 0.2
    """... for this long [s]."""
    growth: tuple[float, float, float] = (0.002, 0.002, 0.0035)
    """Added pose deviation at the first refused odometry [m, m, rad]; doubles at each one more."""
    growth_limit: int = 20
    """No more doublings than that; velocity grows by 1 m/s, heading by 2 rad at most."""
    slip_report: float = 0.5
    """Slip is reported for this long after the last refused odometry [s]."""
    modes: str = "switch"
    """``switch`` (an automaton on evidence), ``imm`` (weighs all modes) or ``single`` (none)."""
    standing_after: float = 0.3
    """Standing, which friction makes exact on wheels: told to stand and odometry unchanged for so
    long [s], and not disturbed; then ..."""
    standing_speed: tuple[float, float, float] = (0.001, 0.001, 0.0005)
    """... velocity is measured as zero with this deviation [m/s, m/s, rad/s] ..."""
    standing_factor: float = 0.01
    """... at each odometry, and the variance of the disturbance is multiplied by this."""
    max_step: float = 0.02
    """Longest single prediction [s]; longer ones are cut, which keeps the noise model true."""
    max_steps: int = 250
    """... into no more than this many."""
    replay: int = 2
    """Measurements fused per tick, beside the newest, until a late one is worked in."""
    floor_tilt: float = 0.02
    """Standard deviation of gravity along an unknown floor [m/s^2]; 0.02 is 0.12 deg."""
    speed: tuple[float, float, float] = (0.5, 0.5, 0.5)
    """Standard deviation of the velocity before the first measurement [m/s, m/s, rad/s]."""
