"""Labels for names of a gearbox file, orders, mode shapes and strain energy distributions."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.results.spectra.run_spectra import element_words
from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.findings import QUANTITY_NAMES
from fe_ste.tools.display import without_round_off

if TYPE_CHECKING:
    import xarray as xr

MOTIONS = {
    "spin": ("rotates", "rotate"),
    "radial": ("moves radially", "move radially"),
    "axial": ("moves axially", "move axially"),
    "tilt": ("tilts", "tilt"),
    "bending": ("bends", "bend"),
    "twist": ("twists", "twist"),
    "stretch": ("stretches", "stretch"),
    "deformation": ("deforms", "deform"),
}
"""Predicates for motions of bodies, singular and plural."""
DESCRIBED_ENERGY, MIN_ENERGY = 0.8, 0.1
"""Fraction of the kinetic energy that a mode description covers, and the minimum fraction of each listed part."""
SHOWN_ELEMENTS = 2
"""Maximum number of elements in a strain energy list."""
_HARMONIC = re.compile(r"(?:(\d+) × )?[^ ]+")
_ROTATION = re.compile(r"(?:(\d+) × )?(half )?rotation of (\S+)(?: in (\S+))?")
_COPY = re.compile(r"^(.*)_(\d+)$")
_OF = re.compile(r"(?<= of )\w+")
_NAME = re.compile(r"\w+(?:-\w+)*")


@dataclass(frozen=True)
class QuantityLabel:
    """Names of one of the quantities."""

    title: str
    column: str
    short: str
    """Column heading of a narrow table."""
    unit: str
    factor: float
    """From SI units."""


QUANTITIES = {
    "error": QuantityLabel("Transmission error", QUANTITY_NAMES["error"], "TE", "µm", 1e6),
    "force": QuantityLabel("Bearing force", QUANTITY_NAMES["force"], "force", "kN", 1e-3),
    "acceleration": QuantityLabel("Acceleration at bearings", QUANTITY_NAMES["acceleration"], "accel.", "m/s²", 1.0),
    "mount_acceleration": QuantityLabel(
        "Acceleration at mounts", QUANTITY_NAMES["mount_acceleration"], "mounts", "m/s²", 1.0
    ),
    "surface_velocity": QuantityLabel("Surface velocity", QUANTITY_NAMES["surface_velocity"], "surface", "mm/s", 1e3),
}
"""Labels of the quantities of a ranking."""


class Labels:
    """Labels for the names of one gearbox.

    Examples
    --------
    >>> words = Labels(Gearbox.from_toml("cases/grc750/gearbox.toml"))
    >>> words.of("hss_bc"), words.of("pl_b_2"), words.of("planet_1"), words.of("im_gear")
    ('high-speed bearing B/C', 'planet bearing B 2', 'planet 1', 'im gear')
    """

    def __init__(self, gearbox: Gearbox) -> None:
        self._gearbox = gearbox
        self._labels = gearbox.case.labels

    def of(self, name: str) -> str:
        """Return the label of a name, or the name with spaces; members of a planet set are numbered."""
        if name in self._labels:
            return self._labels[name]
        copy = _COPY.match(name)
        if copy and copy[1] in self._labels:
            return f"{self._labels[copy[1]]} {copy[2]}"
        return name.replace("_", " ")

    def labelled(self, text: str) -> str:
        """Replace all names of the gearbox file in a text, such as an order or a mode shape, by their labels.

        Examples
        --------
        >>> words = Labels(Gearbox.from_toml("cases/grc750/gearbox.toml"))
        >>> words.labelled("2 x high_speed"), words.labelled("lss axial 94 %; strain energy: lss_bc 99 %")
        ('2 × high-speed', 'low-speed shaft axial 94 %; strain energy: low-speed bearing B/C 99 %')
        """
        named = _NAME.sub(lambda found: self.of(found[0]) if self.family(found[0]) in self._named else found[0], text)
        return named.replace(" x ", " × ")

    def parameter(self, label: str) -> str:
        """Return the label of a parameter, with the label of its body."""
        return _OF.sub(lambda found: self.labelled(found[0]), label)

    def change(self, label: str, value: float, default: float) -> str:
        """Describe the change of a parameter, such as "mesh damping time 16 instead of 4 µs".

        Examples
        --------
        >>> words = Labels(Gearbox.from_toml("cases/grc750/gearbox.toml"))
        >>> words.change("stiffness of planet bearings / default", 2.8, 1.0)
        '2.8 times the stiffness of planet bearings'
        >>> words.change("axial inertia of hss / kg m²", 0.05, 0.1)
        'axial inertia of high-speed shaft 0.05 instead of 0.1 kg m²'
        """
        name, _, unit = self.parameter(label).partition(" / ")
        if unit == "default":
            return f"{figure_text(value)} times the {name}"
        return f"{name} {figure_text(value)} instead of {figure_text(default)} {unit}".rstrip()

    def family(self, name: str) -> str:
        """Return the common name of the members of a planet set."""
        copy = _COPY.match(name)
        return copy[1] if copy and copy[1] in self._copied else name

    @cached_property
    def _copied(self) -> set[str]:
        case = self._gearbox.case
        single = {mesh.name for mesh in self._gearbox.meshes} | set(self._gearbox.named_bodies)
        tables = (case.bodies, case.bearings, case.joints, case.meshes, case.couplings)
        return {name for table in tables for name in table if f"{name}_1" not in table and name not in single}

    @cached_property
    def _named(self) -> set[str]:
        case = self._gearbox.case
        return {*self.labels, *case.labels, *case.couplings, *case.joints}

    @cached_property
    def coupled(self) -> set[str]:
        """Bodies that couplings connect."""
        return {body for coupling in self._gearbox.couplings for body in (coupling.first, coupling.second)}

    @cached_property
    def _carried(self) -> set[str]:
        return {body.name for body in self._gearbox.bodies() if body.carrier}

    @cached_property
    def _meshes(self) -> set[str]:
        return {mesh.name for mesh in self._gearbox.meshes}

    @property
    def labels(self) -> dict[str, str]:
        """Labels by name for everything that pages draw or list."""
        case = self._gearbox.case
        tables = (self._gearbox.named_bodies, case.gears, case.pairs, case.bodies, case.bearings, case.meshes)
        return {name: self.of(name) for table in tables for name in table}

    @cached_property
    def _families(self) -> dict[float, list[str]]:
        """Families of meshes by order."""
        orders = self._gearbox.train.mesh_frequencies(2.0 * np.pi)
        families: dict[float, list[str]] = {}
        for mesh in self._gearbox.meshes:
            key = next((o for o in families if abs(o - orders[mesh.name]) < 1e-6 * o), orders[mesh.name])
            if mesh.family not in families.setdefault(key, []):
                families[key].append(mesh.family)
        return families

    def line(self, line: OrderLine) -> str:
        """Return a short label of an order: harmonic and mesh."""
        if _HARMONIC.fullmatch(line.name) is None:
            return self.labelled(line.name) + self.causes(line.order)
        harmonic, mesh = self._split(line)
        return f"{mesh if harmonic == 1 else f'{harmonic} × {mesh}'}{self.causes(line.order)}"

    def line_sentence(self, line: OrderLine) -> str:
        """Return an order as a noun phrase, such as "the 2nd harmonic of the mesh high-speed"."""
        if rotation := _ROTATION.fullmatch(line.name):
            times = int(rotation[1] or 1) * (0.5 if rotation[2] else 1.0)
            ordinal = {1.0: "1st order", 2.0: "2nd order", 3.0: "3rd order"}.get(times, f"{times:g}th order")
            if times % 1.0:
                ordinal = f"order {times:g}"
            frame = f" in {self.of(rotation[4])}" if rotation[4] else ""
            named = f"the {ordinal} of the rotation of {self.of(rotation[3])}{frame}"
            return named + self.causes(line.order, "excitation ")
        if _HARMONIC.fullmatch(line.name) is None:
            return f"the combination {self.labelled(line.name)}{self.causes(line.order, 'excitation ')}"
        harmonic, mesh = self._split(line)
        ordinal = {1: "mesh frequency", 2: "2nd harmonic", 3: "3rd harmonic"}.get(harmonic, f"{harmonic}th harmonic")
        return f"the {ordinal} of the mesh {mesh}{self.causes(line.order, 'excitation ')}"

    def causes(self, order: float, before: str = "") -> str:
        """Name the excitations of the file at an order of the input in parentheses; empty if there are none.

        Examples
        --------
        >>> ripple = {"body": "hss", "orders": [6], "torque_N_m": [5.0]}
        >>> grc = Gearbox.from_toml("cases/grc750/gearbox.toml").varied({"excitations": {"air_gap": ripple}})
        >>> words = Labels(grc)
        >>> words.causes(6 * grc.train.ratio), words.causes(6.0)
        (' (air gap)', '')
        """
        acting = excitations_at(self._gearbox, order)
        return f" ({before}{', '.join(map(self.of, acting))})" if acting else ""

    def pairs(self, line: OrderLine) -> tuple[int, list[str]]:
        """Return the harmonic of an order and the families of the meshes that excite it; none for a combination."""
        match = _HARMONIC.fullmatch(line.name)
        if match is None:
            return 1, []
        harmonic = int(match[1] or 1)
        order = line.order / harmonic
        return harmonic, next((f for o, f in self._families.items() if abs(o - order) < 1e-6 * order), [])

    def _split(self, line: OrderLine) -> tuple[int, str]:
        harmonic, families = self.pairs(line)
        return harmonic, " and ".join(self.of(family) for family in families or [line.name.rpartition(" × ")[2]])

    def order(self, line: str, order: float) -> OrderLine:
        """Return an order of a steady-state response, such as ``2 x intermediate``, with its name as in run-ups."""
        return OrderLine(line.replace(" x ", " × "), order)

    def kinetic_energy(self, modes: xr.Dataset, index: int) -> dict[tuple[str, str], float]:
        """Return fractions of the kinetic energy by body label and motion; planets are summed."""
        kinetic = modes["kinetic_energy_share"].to_numpy()[index].tolist()
        motions = modes["motion"].to_numpy().tolist()
        shares: dict[tuple[str, str], float] = {}
        for body, of_body in zip(modes["body"].to_numpy().tolist(), kinetic, strict=True):
            name = "planets" if body in self._carried else self.of(body)
            for motion, share in zip(motions, of_body, strict=True):
                shares[name, motion] = shares.get((name, motion), 0.0) + share
        return shares

    def moves(self, modes: xr.Dataset, index: int) -> str:
        """Describe a mode shape by its largest parts of the kinetic energy."""
        shares = self.kinetic_energy(modes, index)
        described = 0.0
        verbs: dict[str, list[str]] = {}
        for (name, motion), share in sorted(shares.items(), key=lambda item: -item[1]):
            if verbs and (described >= DESCRIBED_ENERGY or share < MIN_ENERGY):
                break
            verbs.setdefault(name, []).append(MOTIONS[motion][name == "planets"])
            described += share
        return joined(f"{name} {joined(verb)}" for name, verb in verbs.items())

    def strain_energy(self, modes: xr.Dataset, index: int) -> dict[str, float]:
        """Return fractions of the strain energy by element label, largest first; members of a planet set are summed."""
        shares = modes["strain_energy_share"].to_numpy()[index]
        return self.gathered(dict(zip(element_words(modes), map(float, shares), strict=True)))

    def gathered(self, shares: Mapping[str, float]) -> dict[str, float]:
        """Return fractions by label, largest first; members of a planet set are summed."""
        gathered: dict[str, float] = {}
        for name, share in shares.items():
            itself = name.removesuffix(" itself")
            mesh = "mesh " if itself in self._meshes else ""
            words = mesh + self.of(self.family(itself)) + (" itself" if itself != name else "")
            gathered[words] = gathered.get(words, 0.0) + share
        return dict(sorted(gathered.items(), key=lambda item: -item[1]))


def excitations_at(gearbox: Gearbox, order: float) -> list[str]:
    """Names of the stated loads that have an order (periods per revolution of the input)."""
    speeds = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    return list(
        dict.fromkeys(
            own.excitation
            for own in gearbox.varying_loads
            if math.isclose(own.order * abs(speeds[own.body]), order, rel_tol=1e-6)
        )
    )


def percentages(shares: Mapping[str, float], most: int = SHOWN_ELEMENTS, least: float = 0.01) -> str:
    """Return the largest fractions as text.

    Examples
    --------
    >>> percentages({"mesh": 0.704, "bearing A": 0.2, "bearing B": 0.096})
    'mesh 70 %, bearing A 20 %'
    """
    shown = sorted(shares.items(), key=lambda item: -item[1])[:most]
    return ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in shown if share >= least)


def joined(parts: Iterable[str]) -> str:
    """Join parts of a sentence.

    Examples
    --------
    >>> joined(["a", "b", "c"])
    'a, b and c'
    """
    *first, last = parts
    return f"{', '.join(first)} and {last}" if first else last


def capitalised(text: str) -> str:
    """Return a text with its first letter in upper case."""
    return text[:1].upper() + text[1:]


def figure_text(value: float, digits: int = 3) -> str:
    """Return a number with the given significant digits, without exponent in the usual range.

    Examples
    --------
    >>> figure_text(205.87, 4), figure_text(62.3, 2), figure_text(1234.0), figure_text(-0.0004)
    ('205.9', '62', '1234', '-0.0004')
    """
    value = without_round_off(value)
    if value and abs(value) >= 10.0 ** (digits - 1):
        if abs(value) < 1e7:
            return f"{value:.0f}"
        return f"{value:.{digits - 1}e}"
    return f"{value:.{digits}g}"


def rounded_text(value: float) -> str:
    """Return a number with three significant digits.

    Examples
    --------
    >>> rounded_text(12.0), rounded_text(129.04), rounded_text(0.5), rounded_text(1234.6), rounded_text(0.0)
    ('12.0', '129', '0.500', '1235', '0')
    """
    if value == 0.0 or abs(value) >= 999.5:
        return figure_text(value)
    return f"{value:#.3g}".rstrip(".")
