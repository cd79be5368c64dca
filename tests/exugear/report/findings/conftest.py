from __future__ import annotations

import pytest

from exugear.results.spectra.run_spectra import VariantRun, read_run

from ...results.spectra.run_ups import STORED_LINE, modes_dataset, write_run


@pytest.fixture(scope="session")
def runs(tmp_path_factory) -> tuple[VariantRun, VariantRun]:
    """Bushing resonates at 500, 800 and 1150 Hz, rigid at 500 Hz."""
    folder = tmp_path_factory.mktemp("runs")
    # The mode at 802 Hz lies nearer to the resonance, but nothing of it reaches the overall transmission error.
    modes = modes_dataset([0.0, 497.0, 801.0, 806.0, 1150.0], [0.0, 0.3, 0.0, 0.2, 0.2])
    bushing = read_run(write_run(folder / "b.nc", "bushing", [500.0, 800.0, 1150.0]), [STORED_LINE], modes)
    window = bushing.spectra.window_length
    return bushing, read_run(write_run(folder / "r.nc", "rigid", [500.0]), [STORED_LINE], None, window)
