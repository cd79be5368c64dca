"""Files of what belongs to one key: arrays or a dataset, whole or absent."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fe_ste.tools.sealed import Layout, VersionError, load_arrays, load_dataset, write_arrays, write_dataset

if TYPE_CHECKING:
    import xarray as xr

Arrays = dict[str, NDArray[Any]]
Content = TypeVar("Content")

_KEY = "key"
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Store:
    """File of what was computed from one input, and is computed again where the file does not serve.

    Examples
    --------
    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> store = Store(Path(folder.name) / "angles.npz", key="this input")
    >>> store.write({"angle": np.array([0.0, 0.1])})
    >>> store.read(lambda arrays: arrays["angle"].tolist())
    [0.0, 0.1]
    >>> print(Store(store.path, key="another input").read(dict))
    None
    >>> folder.cleanup()
    """

    path: Path
    """Its directory is made when something is written."""
    key: str
    """Hash of the whole input and of the version of the method. A file of another key is not read."""

    def read(self, unpack: Callable[[Arrays], Content]) -> Content | None:
        """Read what `write` wrote.

        Parameters
        ----------
        unpack : makes what is wanted of the arrays by name. What it misses, or cannot take, means a damaged file.

        Returns
        -------
        What `unpack` gives, or None if the file is missing, of another key, or damaged, which the log tells.
        """
        try:
            arrays = load_arrays(self.path)
            if str(arrays.pop(_KEY, "")) == self.key:
                return unpack(arrays)
            return None
        except (OSError, ValueError, TypeError, LookupError, AttributeError) as error:
            self._tell_of(error)
            return None

    def write(self, arrays: Mapping[str, Any], *, compressed: bool = False) -> None:
        """Write arrays by name, whole or not at all.

        Raises
        ------
        OSError
            The file cannot be written.
        """
        write_arrays(self.path, {_KEY: np.array(self.key), **arrays}, compressed=compressed)

    def read_dataset(self, layout: Layout) -> xr.Dataset | None:
        """Read a dataset with the attribute ``input_hash``; None as in `read`."""
        try:
            dataset = load_dataset(self.path, layout)
        except VersionError:
            return None
        except OSError as error:
            self._tell_of(error)
            return None
        if dataset.attrs.get("input_hash") == self.key:
            return dataset
        return None

    def write_dataset(self, dataset: xr.Dataset) -> None:
        """Write a dataset whose attribute ``input_hash`` is the key, whole or not at all; OSError as in `write`."""
        write_dataset(self.path, dataset.assign_attrs(input_hash=self.key))

    def discard(self) -> None:
        """Remove the file: what it was kept for is done."""
        self.path.unlink(missing_ok=True)

    def _tell_of(self, error: Exception) -> None:
        """Log why a file that is there is not read."""
        if os.path.exists(self.path):
            reason = str(error) if isinstance(error, OSError) else f"{self.path}: is damaged ({error!r})"
            _log.warning("%s; it is computed again", reason)
