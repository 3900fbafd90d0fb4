"""Verdicts on the inertial unit: mounting, bias, noise."""

from __future__ import annotations

import math
from collections.abc import Iterable

from observer.recordings.facts import Diagnosis
from observer.recordings.frames import GRAVITY
from observer.recordings.log import Severity, Verdict

TILTED = math.radians(3.0)
"""Tilt worth a word [rad]."""
ASKEW = math.radians(15.0)
"""A direction forward that is off by this is wrong [rad]."""
SHAKES = 5.0
"""Accelerometer noise in motion over that at rest that is worth a warning."""
HIGH_BIAS = math.radians(0.5)
"""[rad/s]"""


def about_mounting(found: Diagnosis) -> Iterable[Verdict]:
    """Which way up, which way forward."""
    if found.inertial is None:
        return
    m = found.inertial.mounting
    axis = m.up[1]
    if m.up == "+z":
        pass
    elif m.up == "-z":
        text = "accelerometer reads gravity on z, negative: mounted upside down"
        yield Verdict("note", "mounted", f'{text}; up = "{m.up}"')
    else:
        text = f"accelerometer reads gravity on {axis}: mounted on its side"
        yield Verdict("note", "mounted", f'{text}; up = "{m.up}"')
    if m.tilt > TILTED:
        leak = GRAVITY * math.sin(m.tilt)
        yield Verdict(
            "note" if not m.told else "warning",
            "tilted",
            f"the IMU (or the floor) is tilted by {math.degrees(m.tilt):.1f} deg:"
            f" {leak:.2f} m/s^2 of gravity would show as acceleration",
            "levelled by prepare" if not m.told else 'rotation, or up = "auto"',
        )
    if not m.forward:
        yield Verdict(
            "warning",
            "forward",
            f"which way the IMU looks cannot be told: {m.askew.reason}",
            'its accelerometer is not used; say [imu] forward = "+x" or the like',
        )
    elif not m.forward_told and m.askew.value is not None:
        sigma = math.degrees(m.askew.sigma)
        yield Verdict(
            "note", "forward", f'the IMU looks forward along "{m.forward}" (+- {sigma:.0f} deg)'
        )
    elif m.askew.beyond(0.0, ASKEW):
        yield Verdict(
            "warning",
            "forward",
            f"the IMU looks {math.degrees(m.askew.otherwise(0.0)):.0f} deg away from where it is"
            f" said to (+- {math.degrees(m.askew.sigma):.0f} deg)",
            'forward = "auto" finds it',
        )


def about_bias(found: Diagnosis) -> Iterable[Verdict]:
    """Bias of the gyro."""
    if found.inertial is None:
        return
    bias = found.gyro_bias
    if bias.value is None:
        yield Verdict("note", "gyro-bias", f"gyro bias cannot be told: {bias.reason}")
    else:
        high = abs(bias.value) > HIGH_BIAS
        text = f"gyro bias {math.degrees(bias.value):+.3f} deg/s"
        if math.isfinite(bias.sigma):
            text += f" (+- {math.degrees(bias.sigma):.3f})"
        how = "standing" if found.inertial.gyro_bias.told else "against the wheels"
        advice = "let it warm up and calibrate it at rest" if high else ""
        severity: Severity = "warning" if high else "note"
        yield Verdict(severity, "gyro-bias", f"{text}, {how}", advice)
    for step in found.bias_steps:
        size = math.degrees(step.size.otherwise(0.0))
        text = f"gyro bias moved by {size:+.2f} deg/s at {step.at:.0f} s"
        if not step.standing:
            text += " (or the wheels turned without the gyro)"
        yield Verdict("warning", "bias-moved", text, "one bias for all of it does not hold")


def about_noise(found: Diagnosis) -> Iterable[Verdict]:
    """Noise at rest and in motion."""
    unit = found.inertial
    if unit is None:
        return
    if unit.gyro_noise.value is not None and unit.accel_noise.value is not None:
        yield Verdict(
            "note",
            "noise",
            f"at rest the gyro's noise is {math.degrees(unit.gyro_noise.value):.3f} deg/s, the"
            f" accelerometer's {unit.accel_noise.value:.3f} m/s^2 per reading",
        )
        if unit.accel_rough > SHAKES * unit.accel_noise.value:
            yield Verdict(
                "warning",
                "shakes",
                f"the IMU shakes in motion: accelerometer {unit.accel_rough:.2f} m/s^2 per reading"
                f" instead of {unit.accel_noise.value:.3f}",
                "mount it softly, or average it before logging",
            )
    else:
        yield Verdict(
            "note", "never-stands", f"noise at rest cannot be told: {unit.gyro_noise.reason}"
        )
