"""Figures of eigenmodes."""

from __future__ import annotations

import numpy as np

from exugear.studies.figures.point_results import PointError, PointResults
from exugear.system.eigenmodes.modes import FREE_ROTATION, Modes


def frequencies(results: PointResults, *, count: int = 12) -> dict[str, float]:
    """Eigenfrequencies, the lowest first, without free rotation."""
    modes = results.modes
    elastic = [n for n, name in enumerate(modes.names) if name != FREE_ROTATION][:count]
    return {str(number): float(modes.frequency[n]) for number, n in enumerate(elastic, start=1)}


def nearest_frequency(results: PointResults, *, near_Hz: float, element: str = "") -> float:
    """Eigenfrequency nearest to a frequency, or of the modes that strain an element most."""
    return float(results.modes.frequency[_mode(results.modes, near_Hz, element)])


def nearest_damping(results: PointResults, *, near_Hz: float, element: str = "") -> float:
    """Share of critical damping of that mode."""
    return float(results.modes.damping_ratio[_mode(results.modes, near_Hz, element)])


def nearest_amplification(results: PointResults, *, near_Hz: float, element: str = "") -> float:
    """Overall transmission error at resonance of that mode per transmission error of the mesh that excites it most."""
    return float(results.modes.amplification[_mode(results.modes, near_Hz, element)].max())


def nearest_strain(results: PointResults, *, near_Hz: float, element: str) -> float:
    """Share of strain energy of an element in the mode nearest to a frequency."""
    modes = results.modes
    return float(modes.strain[_mode(modes, near_Hz, ""), _element(modes, element)])


def loudest_frequency(results: PointResults, *, from_Hz: float = 0.0, to_Hz: float = 1e6) -> float:
    """Eigenfrequency of the mode between two frequencies that amplifies a mesh's transmission error most."""
    modes = results.modes
    inside = (modes.frequency >= from_Hz) & (modes.frequency <= to_Hz)
    if not inside.any():
        raise PointError(f"no mode between {from_Hz:g} and {to_Hz:g} Hz")
    return float(modes.frequency[np.argmax(np.where(inside, modes.amplification.max(axis=1), -1.0))])


def _mode(modes: Modes, near: float, element: str) -> int:
    """Mode nearest to a frequency (Hz), of those in which an element has the largest share if one is named."""
    elastic = np.array([name != FREE_ROTATION for name in modes.names])
    if element:
        shares = modes.strain[:, _element(modes, element)]
        elastic &= shares >= 0.5 * shares.max(initial=0.0)
    distance = np.where(elastic, np.abs(modes.frequency - near), np.inf)
    return int(np.argmin(distance))


def _element(modes: Modes, name: str) -> int:
    if name not in modes.element_names:
        raise PointError(f"no element {name!r}; elements are {', '.join(modes.element_names)}")
    return modes.element_names.index(name)
