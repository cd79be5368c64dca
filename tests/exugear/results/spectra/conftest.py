from __future__ import annotations

import pytest

from exugear.results.spectra.run_spectra import VariantRun

from .run_ups import two_variants


@pytest.fixture(scope="session")
def runs(tmp_path_factory) -> tuple[VariantRun, VariantRun]:
    return two_variants(tmp_path_factory.mktemp("runs"))
