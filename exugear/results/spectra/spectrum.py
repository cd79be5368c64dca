"""Amplitude spectra of signals, and how finely a window resolves a tone that sweeps."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from fe_ste.tools.arrays import Floats


def amplitude_spectrum(values: ArrayLike, rate: float, window: str = "hann", padding: int = 1) -> tuple[Floats, Floats]:
    """One-sided amplitude spectrum.

    Parameters
    ----------
    values : (..., n) signal, along the last axis. One in single precision is analysed so, in half the time.
    rate : sampling rate, Hz
    window : name of a SciPy window. ``"flattop"`` reads amplitudes between bins to 0.1 %, ``"hann"`` to 15 %.
    padding : length after appending zeros over `n`: spectral lines in between, no finer resolution

    Returns
    -------
    frequency : (padding n // 2 + 1,) Hz
    amplitude : (..., padding n // 2 + 1) peak amplitude of a sine at that frequency; at frequency zero the mean

    Examples
    --------
    >>> time = np.arange(1000) / 1000.0
    >>> frequency, amplitude = amplitude_spectrum(3.0 * np.cos(2 * np.pi * 50.0 * time), 1000.0)
    >>> float(frequency[50]), round(float(amplitude[50]), 12)
    (50.0, 3.0)
    """
    import scipy.signal  # loads all of scipy.stats, for which others need not wait

    signal = np.asarray(values)
    kind = np.float32 if signal.dtype == np.float32 else np.float64
    count = padding * signal.shape[-1]
    weights = scipy.signal.get_window(window, signal.shape[-1])  # periodic: a tone on a bin comes out exactly
    scaled = (2.0 / weights.sum() * weights).astype(kind)
    amplitude: Floats = np.abs(scipy.fft.rfft(signal * scaled, n=count, axis=-1))
    amplitude[..., 0] *= 0.5
    if count % 2 == 0:
        amplitude[..., -1] *= 0.5
    frequency = np.arange(amplitude.shape[-1]) * (rate / count)
    return frequency, amplitude


def sweep_limited_resolution(sweep_rate: ArrayLike) -> Floats:
    """Finest frequency resolution of a tone that sweeps, Hz: the root of its rate (Hz/s).

    During a window T the tone sweeps over rate x T, while the window resolves 1/T: best where both are equal.

    Examples
    --------
    >>> float(np.round(sweep_limited_resolution(214.0), 1))
    14.6
    """
    resolution: Floats = np.sqrt(np.abs(np.asarray(sweep_rate, dtype=np.float64)))
    return resolution


def sweep_matched_window(sweep_rate: float) -> float:
    """Window length, s, that resolves a tone sweeping at a rate (Hz/s) best.

    Examples
    --------
    >>> round(1e3 * sweep_matched_window(214.0))  # milliseconds
    68
    """
    if not abs(sweep_rate) > 0.0:
        raise ValueError("sweep rate = 0: a steady tone has no best window, choose its length")
    return 1.0 / math.sqrt(abs(sweep_rate))
