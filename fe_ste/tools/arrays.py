"""Type aliases for arrays: each names the element type. Docstrings give shapes and units."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Booleans", "Complexes", "Floats", "Integers", "Pixels", "SingleComplexes", "SparseMatrix", "Texts"]

Booleans: TypeAlias = NDArray[np.bool_]
Complexes: TypeAlias = NDArray[np.complex128]
Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
SingleComplexes: TypeAlias = NDArray[np.complex64]
Pixels: TypeAlias = NDArray[np.uint8]
Texts: TypeAlias = NDArray[np.str_]
SparseMatrix: TypeAlias = Any  # any scipy.sparse matrix or array: their common base class has no arithmetic
