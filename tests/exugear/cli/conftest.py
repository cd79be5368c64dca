"""The smallest case as a file, on which the verbs are called."""

from __future__ import annotations

from pathlib import Path

import pytest

from ..cases.spur import SPUR_CASE


@pytest.fixture
def case(tmp_path: Path) -> Path:
    path = tmp_path / "spur.toml"
    path.write_text(SPUR_CASE, encoding="utf-8")
    return path
