"""Figures of a run in words, with their units."""

from __future__ import annotations

PEN_LABELS = {
    "line_rms_mm": "contour error, rms [mm]",
    "line_max_mm": "contour error, largest [mm]",
    "tracked_rms_mm": "tracked error, rms [mm]",
    "circle_axis_ratio": "circle, ratio of axes",
    "contact_fraction": "pen on the board while drawing",
    "force_rms_error_n": "force error over 20 ms, rms [N]",
    "torque_step_fraction": "torque step at node changes / ordinary 99 % ripple",
}
PLATFORM_LABELS = {
    "platform_way_m": "way driven [m]",
    "platform_time_s": "time until the platform's task was over [s]",
    "platform_clearance_mm": "smallest clearance to an obstacle [mm]",
    "platform_goal_mm": "true distance to the goal at the end [mm]",
    "platform_goal_deg": "true heading off the goal's at the end [deg]",
    "platform_speed": "largest speed commanded, vx or vy [m/s]",
    "platform_acceleration": "largest acceleration commanded [m/s²]",
    "platform_jerk": "largest jerk commanded [m/s³]",
    "platform_stops": "stops on the way",
    "platform_blocked_s": "blocked or stopped [s]",
}
GRASP_LABELS = {
    "box_height_mm": "box above where it stood, at the end [mm]",
    "box_tilt_deg": "largest tilt of the box off the table [deg]",
    "palm_force_peak_n": "largest force on a palm [N]",
}
BOTTLE_LABELS = {
    "placed_error_mm": "bottle from its goal [mm]",
    "placed_tilt_deg": "tilt of the bottle at the end [deg]",
    "carried_tilt_deg": "largest tilt off the table [deg]",
    "carried_slip_mm": "moved in the hand off the table [mm]",
    "tip_force_peak_n": "largest force on a fingertip [N]",
    "still_rms_mm": "hand in the world while the platform goes to and fro, rms [mm]",
    "still_max_mm": "the same, largest [mm]",
    "still_rms_deg": "the same, turned, rms [deg]",
    "still_platform_mm": "the platform meanwhile, way across [mm]",
    "still_platform_deg": "the same, turn [deg]",
    "tries": "reaches",
}
LABELS = {
    "estimate_rms_mm": "estimate error, rms [mm]",
    "estimate_rms_deg": "estimate error, rms [deg]",
    "estimate_max_step_mm_per_ms": "largest estimate step beyond true motion [mm/ms]",
    "realtime_factor": "times real time",
    "simulated_s": "simulated [s]",
}
