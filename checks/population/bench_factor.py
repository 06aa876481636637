"""The factor of a bench on each channel of every unit, learned from the residuals of fits of several units.

Each unit gives H / H_model - 1, the ratio of its response to its own fit. The part common to all units belongs to the
bench; it is smoothed as far as the records allow, scale by scale, by how far it exceeds the noise on each. The rest of
each unit is its own, and its size gives the tolerance for one more unit. A unit that differs from the others in some
band and channel is weighted less there, so that its own effect does not become the bench's.

Discrepancy of a model: [KENNEDY01]; shrinkage of details scale by scale: [DONOHO95]; weights: [LLT89]."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.fitting.whitener import fill_dips
from checks.model.learned_bench import LearnedBench

SCALES_OCTAVES = (2.0, 0.5, 0.12, 0.03, 0.008)  # half-widths of the averages, from the widest on
BLOCK = 0.5  # octaves over which a unit is compared with the others
NU = 4.0  # of the t distribution of units about their middle: one ten times off counts for a twentieth
LEFT_OUT = 3  # of so many units the one farthest off says nothing about how far off units are, nor of fewer
OF_THE_REST = 1.6  # their sd over the rms of what is left of a normal distribution then
LEAST = 1e-3  # relative distance that is no difference
LATE = -2j * np.pi  # derivative of a channel by its latency, relative, over f
TURNS = 20
BESIDE_ZEROS = 3e-3  # of the response around a zero: what is left in it says nothing about a factor
WORTH = 1.5  # times its noise that the energy of details has to be, on average around, to count at all
AROUND = 3.0  # times the scale: over less, noise alone is often as large
RESONANCE_OCTAVES = 0.5  # a change within that is a resonance
RESONANCE = 0.004  # relative, from which on it counts as one
COUPLED = 1.5  # times its size
NARROW = 0.02  # of f, over which the scatter from unit to unit is averaged


@dataclass(frozen=True, eq=False)
class BenchFactor:
    """The factor of a bench on its responses. learned: the factor; weights (n, F, C) of each unit."""

    learned: LearnedBench
    weights: Array


def learn_factor(f: Array, ratios: Complex, noise: Array, sizes: Array, channels: tuple[str, ...]) -> BenchFactor:
    """Return the common factor of n units at f (F,) [Hz].

    ratios (n, F, C): H / H_model - 1 of each unit; noise (n, F, C): their variance from noise; sizes (n, F, C): the
    model's |H|. At least three units: of two that differ, neither can be preferred."""
    filled = np.array([fill_dips(f, s) for s in sizes])
    dip = filled / sizes
    variance = noise + np.where(dip > 1.0, (BESIDE_ZEROS * dip) ** 2, 0.0)
    weights = unit_weights(f, ratios, variance)
    trust = weights / (variance + LEAST**2)
    total = trust.sum(axis=0)
    mean = (trust * ratios).sum(axis=0) / total
    of_noise = (trust**2 * variance).sum(axis=0) / total**2
    counted = weights.sum(axis=0)
    n_like = np.maximum(counted**2 / (weights**2).sum(axis=0), 1.5)
    mean = mean - np.outer(f, latency(f, mean, of_noise)) * LATE
    d, d_noise = smooth(f, mean, of_noise)
    left = (np.abs(ratios - d) ** 2 - noise) / dip**2
    scatter = np.clip(local_mean(f, (weights * left).mean(axis=0), NARROW), 0.0, None)
    scatter *= n_like / (n_like - 1.0)
    # Few units know their scatter badly: the interval of one more is that of a t distribution.
    tolerance = np.sqrt(scatter * (n_like + 1.0) / (n_like - 0.5))
    tolerance = np.hypot(tolerance, resonant(f, d, d_noise))
    learned = LearnedBench(f, channels, d, np.sqrt(d_noise + scatter / n_like), tolerance)
    return BenchFactor(learned, weights)


def resonant(f: Array, d: Complex, variance: Array) -> Array:
    """Return the possible deviation (F, C) of one more unit where the bench resonates. Its share of a resonance depends
    on its coupling: a misaligned unit may show three times as much as the units that were learned from."""
    wide = kernel(f, RESONANCE_OCTAVES)
    sharp = np.abs(d - (wide / wide.sum(axis=1, keepdims=True)) @ d)
    sharp = np.where(sharp**2 > 9.0 * variance, sharp, 0.0)
    around = local_mean(f, sharp, 2.0 * NARROW)
    return np.where(around > RESONANCE, COUPLED * around, 0.0)


def latency(f: Array, mean: Complex, variance: Array) -> Array:
    """Return the latency [s] (C,) of each channel in a mean (F, C), which has a name and is not part of the unexplained
    factor. Frequencies at which a resonance turns the phase count little."""
    tau = np.zeros(mean.shape[1])
    for _ in range(TURNS):
        left = mean - np.outer(f, tau) * LATE
        trust = 1.0 / (variance + LEAST**2 + np.abs(left) ** 2)
        turned = LATE.imag * f[:, None]
        tau = (trust * turned * mean.imag).sum(axis=0) / (trust * turned**2).sum(axis=0)
    return tau


def unit_weights(f: Array, ratios: Complex, variance: Array) -> Array:
    """Return the weight of each unit (n, F, C): about 1 at a usual distance from the median of all ([LLT89])."""
    middle = np.median(ratios.real, axis=0) + 1j * np.median(ratios.imag, axis=0)
    place = np.log2(f / f[0]) / BLOCK
    _, blocks = np.unique(np.floor(place), return_inverse=True)
    centres = np.bincount(blocks, place) / np.bincount(blocks)
    away = np.abs(ratios - middle) ** 2 - variance
    of_blocks = np.stack([np.median(away[:, blocks == k], axis=1) for k in range(centres.size)], axis=1)
    distance = np.sqrt(np.clip(of_blocks, 0.0, None))
    nearest = np.sort(distance, axis=0)[: -max(len(ratios) // LEFT_OUT, 1)]
    usual = OF_THE_REST * np.maximum(np.sqrt(np.mean(nearest**2, axis=0)), LEAST)
    weight = (NU + 1.0) / (NU + (distance / usual) ** 2)
    found = np.ones(ratios.shape)
    for i, c in np.ndindex(ratios.shape[0], ratios.shape[2]):
        found[i, :, c] = np.interp(place, centres, weight[i, :, c])
    return found


def smooth(f: Array, mean: Complex, variance: Array) -> tuple[Complex, Array]:
    """Return a mean (F, C) smoothed as its noise (F, C) requires, and the variance of the noise that is left."""
    d, d_variance = np.zeros_like(mean), np.zeros_like(variance)
    for width in SCALES_OCTAVES:
        K = kernel(f, width)
        around = kernel(f, AROUND * width)
        even = around / around.sum(axis=1, keepdims=True)
        for c in range(mean.shape[1]):
            weight = K / (variance[:, c] + LEAST**2)
            weight /= weight.sum(axis=1, keepdims=True)
            detail = weight @ (mean[:, c] - d[:, c])
            noise = weight**2 @ variance[:, c]
            energy = even @ np.abs(detail) ** 2
            share = np.clip(1.0 - WORTH * (even @ noise) / np.maximum(energy, 1e-300), 0.0, 1.0)
            d[:, c] += share * detail
            d_variance[:, c] += share * noise
    return d, d_variance


def local_mean(f: Array, values: Array, width: float) -> Array:
    """Return the values (F, C) averaged over so large a part of f."""
    K = kernel(f, float(np.log2(1.0 + width)))
    return np.asarray((K / K.sum(axis=1, keepdims=True)) @ values)


def kernel(f: Array, half_octaves: float) -> Array:
    """Return the weights (F, F) that fall to zero at a distance of so many octaves."""
    x = np.log2(f)
    away = np.abs(x[:, None] - x[None, :]) / half_octaves
    found: Array = np.where(away < 1.0, np.cos(0.5 * np.pi * np.minimum(away, 1.0)) ** 2, 0.0)
    np.fill_diagonal(found, 1.0)
    return found
