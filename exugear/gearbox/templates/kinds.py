"""Kinds of gearboxes for which a template file exists; each template can be run unchanged."""

from __future__ import annotations

from importlib.resources import files

KINDS = {
    "pair": "one helical pair on ball bearings",
    "parallel": "two helical stages on three parallel shafts",
    "e-axle": "an electric machine with torque ripple and two helical stages, ratio 9",
    "planetary": "a planetary stage with three planets and a fixed ring gear",
    "wind": "a planetary and two parallel stages, of a 600 kW wind turbine",
}
"""Description of each kind."""


def template(kind: str) -> str:
    """Template gearbox file of one of `KINDS`, as text.

    Examples
    --------
    >>> template("pair").splitlines()[0]
    '# One helical gear pair on ball bearings: a template for your own gearbox.'
    """
    return files(__package__).joinpath(f"{kind}.toml").read_text(encoding="utf-8")
