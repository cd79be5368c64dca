"""Kinds of gearboxes that a file to start from is at hand for; each runs as it is."""

from __future__ import annotations

from importlib.resources import files

KINDS = {
    "pair": "one helical pair on ball bearings",
    "parallel": "two helical stages on three parallel shafts",
    "planetary": "a planetary stage with three planets and a fixed ring gear",
    "wind": "a planetary and two parallel stages, size of a 1 MW wind turbine",
}
"""What each kind is, in words."""


def template(kind: str) -> str:
    """Gearbox file of a kind, as text.

    Parameters
    ----------
    kind : one of `KINDS`

    Examples
    --------
    >>> template("pair").splitlines()[0]
    '# One helical gear pair on ball bearings: a template for your own gearbox.'
    """
    return files(__package__).joinpath(f"{kind}.toml").read_text(encoding="utf-8")
