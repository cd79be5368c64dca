"""Distributions of parameters, by the inverse of their distribution functions, and draws that are correlated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from fe_ste.tools.arrays import Floats

Sampling = Literal["sobol", "latin_hypercube", "random"]
_OPEN = 1e-15
"""Distance from 0 and 1 at which a share is kept: a normal distribution has no end."""


class Distribution(Protocol):
    """What draws are taken from."""

    def at(self, share: Floats) -> Floats:
        """Values that a share (0 to 1) of all draws lies below."""
        ...


@dataclass(frozen=True)
class Normal:
    """Normal distribution, cut off where limits are given.

    Examples
    --------
    >>> Normal(0.0, 1.0).at(np.array([0.5, 0.975])).round(3).tolist()
    [0.0, 1.96]
    """

    mean: float
    deviation: float
    """Of the distribution before it is cut off."""
    least: float = -math.inf
    most: float = math.inf
    """Draws lie between."""

    def at(self, share: Floats) -> Floats:
        """Values that a share (0 to 1) of all draws lies below."""
        low, high = ndtr((np.array([self.least, self.most]) - self.mean) / self.deviation)
        inside = np.clip(low + share * (high - low), _OPEN, 1.0 - _OPEN)
        values = self.mean + self.deviation * ndtri(inside)
        return np.asarray(np.clip(values, self.least, self.most), dtype=np.float64)


@dataclass(frozen=True)
class Uniform:
    """Every value between two is as likely.

    Examples
    --------
    >>> Uniform(2.0, 4.0).at(np.array([0.25])).tolist()
    [2.5]
    """

    least: float
    most: float

    def at(self, share: Floats) -> Floats:
        """Values that a share (0 to 1) of all draws lies below."""
        return np.asarray(self.least + share * (self.most - self.least), dtype=np.float64)


def shares(sampling: Sampling, count: int, dimensions: int, seed: int) -> Floats:
    """Points of the unit cube (count, dimensions), evenly spread; the same for the same seed.

    A Sobol sequence that is made longer begins with the points it had.

    Parameters
    ----------
    sampling : {"sobol", "latin_hypercube", "random"}
    count : of Sobol points a power of two

    Examples
    --------
    >>> shares("latin_hypercube", 4, 2, seed=1).shape
    (4, 2)
    """
    generator = np.random.default_rng(seed)
    if sampling == "random":
        return generator.random((count, dimensions))
    if sampling == "sobol":
        points = qmc.Sobol(dimensions, rng=generator).random_base2(round(math.log2(count)))
    else:
        points = qmc.LatinHypercube(dimensions, rng=generator).random(count)
    return np.asarray(points, dtype=np.float64)


def correlated(independent: Floats, correlation: float) -> Floats:
    """Shares (count, members) of a group whose members are correlated pair by pair (Gaussian copula).

    Parameters
    ----------
    independent : (count, members) shares that are not correlated
    correlation : of the normal variables behind any two members, 0 to 1

    Examples
    --------
    >>> same = correlated(np.array([[0.2, 0.9]]), 1.0)
    >>> bool(np.allclose(same, 0.2))
    True
    """
    members = independent.shape[1]
    if correlation in (0.0, 1.0) or members == 1:
        if correlation == 1.0:
            return np.repeat(independent[:, :1], members, axis=1)
        return independent
    matrix = np.full((members, members), correlation) + (1.0 - correlation) * np.eye(members)
    normal = ndtri(np.clip(independent, _OPEN, 1.0 - _OPEN)) @ np.linalg.cholesky(matrix).T
    return np.asarray(ndtr(normal), dtype=np.float64)
