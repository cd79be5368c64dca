from __future__ import annotations

import numpy as np
import skfem
from matplotlib.figure import Figure

from exugear.report.pictures.scene import draw_free_vibration
from exugear.system.bodies.solid_elements import SolidSeat
from exugear.system.bodies.solids import SolidModel, reduce_solid
from fe_ste.geometry.gear_relations import Material

from ....optional_libraries import needs_rendering


def drawn(figure: Figure) -> np.ndarray:
    """Pixels of the picture itself, scales aside."""
    return figure.axes[0].images[0].get_array()


@needs_rendering
def test_a_bar_is_drawn_bent_in_its_first_vibration_and_is_hottest_at_its_ends(tmp_path):
    lines = [np.linspace(0.0, length, n) for length, n in ((0.1, 3), (0.1, 3), (1.0, 9))]
    mesh = skfem.MeshHex2.from_mesh(skfem.MeshHex.init_tensor(*lines))
    seats = tuple(SolidSeat(name, (0.05, 0.05, z), 0.1) for name, z in (("low", 0.0), ("high", 1.0)))
    bar = reduce_solid(SolidModel("bar", mesh, Material(), seats, "ground", 1000.0, 12e3))
    figure = draw_free_vibration(bar, 0, tmp_path / "bar.png")
    assert (tmp_path / "bar.png").stat().st_size > 10_000
    # Euler-Bernoulli, 4.73^2 / (2 pi) sqrt(E I / rho A) / L^2 = 527 Hz for a thin bar; one of L / 10 is 4 to 5 % below.
    shown = float(figure.axes[0].get_title(loc="left").split(":")[1].split()[0])
    assert 480.0 < shown < 515.0
    pixels = drawn(figure).astype(int)
    purple = (pixels[..., 0] < 130) & (pixels[..., 1] < 60) & (pixels[..., 2] > 40)
    columns = np.flatnonzero(purple.any(axis=0)) / pixels.shape[1]
    assert columns.size  # the ends move most
    assert ((columns < 0.3) | (columns > 0.7)).all()
