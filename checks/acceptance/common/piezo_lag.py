"""Lag of a piezo stack behind its drive: how wide its loop must be, and which data are too exact to be measured.

The opening of a loop relative to its height is the sine of the loss angle. Multilayers of soft PZT lose 1 to 2 percent
even at small signals and several at their full range ([DAMJANOVIC98]), so a response without a loop is the drive
itself, looped back, or was shifted in time against it."""

import numpy as np

from checks.arrays import Array
from checks.cause import Cause, NoResult
from checks.signals.slow.loops import ScalarEstimate
from checks.signals.slow.regression import least_squares

ALIKE = 1e-7  # of the height: below the step of a converter of 24 bits


def vet_lag(name: str, drive: str, width: ScalarEstimate, height: float, least_percent: float) -> None:
    """Raise NoResult if a response opens its loop by less than `least_percent` of its height, beyond the scatter.

    width, height: in one unit; the width positive if the response lags."""
    percent, u = 100 * width.value / height, 100 * width.u / height
    if percent + 3 * u < least_percent:
        raise NoResult(Cause.LOOP_NARROW, channel=name, reference=drive, percent=percent, least=least_percent)


def vet_bend(name: str, drive: Array, response: Array, height: float, least_percent: float) -> None:
    """Raise NoResult if a response that only rises does so along a straight line. By Rayleigh's law a first rise bows
    by as much as its loop would open; half is required."""
    s = (drive - drive.min()) / np.ptp(drive)
    fit = least_squares(np.vander(s, 3, increasing=True), response)
    bow = ScalarEstimate(abs(float(fit.x[2])) / 4, fit.u(np.array([0.0, 0.0, 1.0])) / 4)
    percent, u = 100 * bow.value / height, 100 * bow.u / height
    if percent + 3 * u < least_percent / 2:
        raise NoResult(Cause.NO_CURVATURE, channel=name, percent=percent)


def vet_noise(name: str, misfit: float) -> None:
    """Raise NoResult if a response follows its loop more exactly than any converter can resolve. misfit: rms of the
    residual of the loop's shape, relative to half the height."""
    if misfit < ALIKE:
        raise NoResult(Cause.CHANNEL_NOISELESS, channel=name)
