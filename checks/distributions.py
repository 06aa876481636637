"""Distributions that the checks need, by scipy.special, equal to those of scipy.stats to the last digit.

scipy.stats takes a second and a half to load, longer than most commands run; a test holds every function to it.
Arguments broadcast; the result has their shape."""

import math
from typing import Any

import numpy as np
from scipy import special

from checks.arrays import Array


class chi2:
    """Chi-squared with dof degrees of freedom."""

    @staticmethod
    def sf(x: Any, dof: Any) -> Any:
        """Return the probability of a value above x."""
        return special.chdtrc(dof, np.maximum(x, 0.0))

    @staticmethod
    def isf(p: Any, dof: Any) -> Any:
        """Return the value that is exceeded with probability p."""
        return special.chdtri(dof, p)

    @staticmethod
    def ppf(p: Any, dof: Any) -> Any:
        """Return the value that is not exceeded with probability p."""
        return 2 * special.gammaincinv(np.asarray(dof) / 2, p)

    @staticmethod
    def median(dof: Any) -> Any:
        return chi2.ppf(0.5, dof)

    @staticmethod
    def logsf(x: Any, dof: Any) -> Array:
        """Return the logarithm of `sf`, with full precision even if `sf` is nearly 1."""
        with np.errstate(divide="ignore"):
            upper, lower = np.log(special.chdtrc(dof, x)), np.log1p(-special.chdtr(dof, x))
        return np.asarray(np.where(x > chi2.median(dof), upper, lower))


class norm:
    """The standard normal distribution."""

    @staticmethod
    def pdf(x: Any) -> Any:
        """Return the density at x."""
        return np.exp(-(np.asarray(x) ** 2) / 2.0) / math.sqrt(2 * math.pi)

    @staticmethod
    def sf(x: Any) -> Any:
        """Return the probability of a value above x."""
        return special.ndtr(np.negative(x))

    @staticmethod
    def ppf(p: Any) -> Any:
        """Return the value that is not exceeded with probability p."""
        return special.ndtri(p)

    @staticmethod
    def isf(p: Any) -> Any:
        """Return the value that is exceeded with probability p."""
        return -special.ndtri(p)


class t:
    """Student's distribution with dof degrees of freedom."""

    @staticmethod
    def sf(x: Any, dof: Any) -> Any:
        """Return the probability of a value above x."""
        return special.stdtr(dof, np.negative(x))

    @staticmethod
    def ppf(p: Any, dof: Any) -> Any:
        """Return the value that is not exceeded with probability p."""
        return np.where(np.equal(p, 0.0), -np.inf, special.stdtrit(dof, p))[()]


class f:
    """Fisher's distribution with one and other degrees of freedom."""

    @staticmethod
    def sf(x: Any, one: Any, other: Any) -> Any:
        """Return the probability of a value above x."""
        return special.fdtrc(one, other, np.maximum(x, 0.0))
