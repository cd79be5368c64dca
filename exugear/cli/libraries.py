"""Libraries that are installed and not wanted: Dask, which xarray loads with the first data set if it is there."""

from __future__ import annotations

import sys
from typing import Any

_modules: dict[str, Any] = sys.modules


def leave_out_dask() -> None:
    """Let Dask look as if it were not installed: half a second of each verb, none of which has an array of it."""
    _modules.setdefault("dask", None)


def let_in_dask() -> None:
    """Let Dask be found again, by what sends work to its clusters."""
    if _modules.get("dask", ...) is None:
        del _modules["dask"]
