"""Results of the text of a gearbox file, step by step: errors, kinematics, picture, modes, static loads, shapes.

Mesh stiffness is that of ISO 6336-1 and bodies are rigid, so that no finite elements are needed. Nothing is written.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from exugear.cli.case import assembled_by_iso, checked_gearbox
from exugear.cli.console import BadInputError, FailedError, model_errors
from exugear.cli.edit.places import Remark, placed
from exugear.cli.tables import Column, significant
from exugear.cli.tasks import bearings as bearings_task
from exugear.cli.tasks import check as check_task
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import operating_range
from exugear.gearbox.named_files import NOTHING_MORE, Permissions
from exugear.gearbox.reading import GearboxFileError, parsed_toml, plain_lines
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.words import Labels
from exugear.report.pictures.shapes import TriangleSurface
from exugear.report.web.document import ArrayStore, rounded, rounded_list
from exugear.report.web.stage import DrawnBody, bodies_data, motions_data, rigid_bodies
from exugear.results.folder import duty_summary
from exugear.system.gearbox_checks import gearbox_warnings, lacking, usual_variant
from exugear.system.modes import CampbellDiagram, Modes, modes_of, unusual_damping
from exugear.system.operating_points import bearing_duties
from exugear.system.statics import RIGID_BODY_LIMIT, StaticState, static_state
from exugear.system.system import Assembly

KEPT = 6
"""Number of last states whose results are kept, for undo and for a second tab."""
POINTS_OF_A_BODY = 61
"""Every so many points of a body are used to find its largest displacement in a mode."""
GREATEST_SPEED = 1500.0
"""Input speed (rpm) of the kinematics of a file that specifies neither an operating range nor a rated speed."""

SPEEDS = (
    Column("body", "body"),
    Column("speed rpm", "speed_rpm", partial(significant, digits=5, decimals=4)),
    Column("speed ratio", "ratio", partial(significant, digits=5, decimals=4)),
)
FREQUENCIES = (
    Column("mesh", "mesh"),
    Column("teeth", "teeth", lambda teeth: "{}/{}".format(*teeth)),
    Column("mesh frequency Hz", "frequency_Hz", partial(significant, digits=5, decimals=3)),
    Column("order of the input", "order", partial(significant, digits=6, decimals=4)),
)
MESHES = (
    Column("mesh", "mesh"),
    Column("mesh force kN", "force_kN", partial(significant, digits=3)),
    Column("misalignment mrad", "misalignment_mrad", ".3f"),
    Column("gap at +z end µm", "opening_um", ".1f"),
    Column("change of centre distance µm", "centre_distance_change_um", ".1f"),
)
MODES = (
    Column("No.", "number"),
    Column("frequency Hz", "frequency_Hz", ".1f"),
    Column("damping %", "damping_percent", ".1f"),
    Column("mode shape", "shape", is_text=True),
)


@dataclass(frozen=True)
class CheckedText:
    """Text of a gearbox file after its check."""

    text: str
    gearbox: Gearbox | None
    """None if the text has errors."""
    remarks: tuple[Remark, ...]
    content: Mapping[str, Any] | None
    """None if the text is no TOML."""


class Analyst:
    """Results of texts of one gearbox file, whose scripts are never run; results of the last texts are kept."""

    def __init__(self, source: str | Path, permissions: Permissions = NOTHING_MORE) -> None:
        self._source = str(source)
        self._permissions = replace(permissions, scripts=False)
        self._lock = threading.Lock()
        self._kept: dict[str, list[dict[str, Any]]] = {}
        self._latest: dict[str, object] = {}
        self._picture: dict[str, Any] = {"geometry": ""}
        self._assembly: Assembly | None = None

    def steps(self, text: str, tab: str = "", geometry: str = "") -> Generator[dict[str, Any]]:
        """Yield the results of a text step by step; a newer request of the same tab ends an older one.

        Parameters
        ----------
        tab : name of the tab of the browser that asks
        geometry : name of the bodies that it has already; their points are then left out

        Yields
        ------
        dict
            For JSON, with the key ``step``: ``check``, ``picture``, ``dynamics``, ``loads`` and ``shapes``, or
            ``superseded``.
        """
        request = self.ask(tab)
        digest = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
        with self._lock:
            kept = self._kept.pop(digest, [])
            made = iter(kept) if kept else self._made(text)
            done: list[dict[str, Any]] = []
            while True:
                if self._latest[tab] is not request:
                    yield {"step": "superseded"}
                    return
                step = next(made, None)
                if step is None:
                    break
                done.append(step)
                if step["step"] == "picture" and step["geometry"] == geometry:
                    step = {**step, "arrays": {}}
                yield step
            self._kept[digest] = done
            while len(self._kept) > KEPT:
                del self._kept[next(iter(self._kept))]

    def ask(self, tab: str) -> object:
        """Register a request of a tab, which ends the one before."""
        self._latest[tab] = request = object()
        return request

    def _made(self, text: str) -> Iterator[dict[str, Any]]:
        checked = self.check(text)
        yield checked_data(checked)
        if checked.gearbox is None:
            return
        try:
            with model_errors():
                bodies = rigid_bodies(checked.gearbox)
                yield self._pictured(bodies, Labels(checked.gearbox).labels)
                variant = usual_variant(checked.gearbox)
                self._assembly = assembly = assembled_by_iso(checked.gearbox, variant, self._assembly)
                modes = modes_of(assembly)
                warnings = self._warnings([unusual_damping(modes)], text)
                yield {"step": "dynamics", **dynamics(modes), "remarks": warnings}
                tables, remarks = loads(assembly)
                unavailable = "" if assembly.variant.has_bearings else lacking(checked.gearbox, Variant.bushing)
                warnings = self._warnings(remarks, text)
                yield {"step": "loads", "tables": tables, "unavailable": unavailable, "remarks": warnings}
                yield {"step": "shapes", "tables": {"modes": _mode_table(modes)}, **motions(modes, bodies)}
        except (BadInputError, FailedError) as error:
            errors = placed(str(error).splitlines(), "error", self._source, text)
            yield {"step": "dynamics", "failed": True, "remarks": [asdict(remark) for remark in errors]}

    def _pictured(self, bodies: tuple[DrawnBody, ...], labels: Mapping[str, str]) -> dict[str, Any]:
        """Return the step ``picture``; most changes of a text leave it as it was.

        The digest of the shapes and labels is the name of the geometry.
        """
        digest = hashlib.sha256(repr(sorted(labels.items())).encode())
        for body in bodies:
            digest.update(f"{body.shape.name} {body.owner} {body.colour} {body.shape.fixed}".encode())
            for values in (body.shape.surface.points, body.shape.surface.triangles, body.shape.reference):
                digest.update(np.ascontiguousarray(values).tobytes())
        geometry = digest.hexdigest()[:16]
        if self._picture["geometry"] != geometry:
            arrays = ArrayStore(f"{geometry}-", level=1)
            stage = bodies_data(bodies, labels, arrays)
            self._picture = {"step": "picture", "geometry": geometry, "stage": stage, "arrays": arrays.packed()}
        return self._picture

    def _warnings(self, lines: Iterable[str], text: str) -> list[dict[str, Any]]:
        """Return warnings about the text for JSON, without empty and repeated ones."""
        return [asdict(one) for one in placed(dict.fromkeys(filter(None, lines)), "warning", self._source, text)]

    def check(self, text: str) -> CheckedText:
        """Read and check a text."""
        content = None
        try:
            content = parsed_toml(plain_lines(text), self._source)
            gearbox = checked_gearbox(content, self._source, self._permissions)
            # Errors of loads and of the train are found only when these are used.
            with model_errors():
                warnings = [*gearbox_warnings(gearbox), *check_task.script_notes(gearbox)]
                kinematics(gearbox)
        except (GearboxFileError, BadInputError, FailedError) as error:
            errors = error.errors if isinstance(error, GearboxFileError) else str(error).splitlines()
            return CheckedText(text, None, tuple(placed(errors, "error", self._source, text)), content)
        return CheckedText(text, gearbox, tuple(placed(warnings, "warning", self._source, text)), content)


def checked_data(checked: CheckedText) -> dict[str, Any]:
    """Return the step ``check``: errors and warnings at their lines, and kinematics and geometry without errors."""
    told: dict[str, Any] = {"step": "check", "remarks": [asdict(remark) for remark in checked.remarks]}
    gearbox = checked.gearbox
    if gearbox is None:
        return {**told, "ok": False}
    pairs = [check_task.pair_summary(gearbox, name) for name in gearbox.pairs]
    return {
        **told,
        "ok": True,
        "name": gearbox.name,
        "ratio": gearbox.train.ratio_text,
        "tables": {
            **kinematics(gearbox),
            "pairs": table_data(
                check_task.PAIRS, pairs, "pairs", f"{check_task.PAIR_LEGEND} {check_task.PAIR_DETAILS}"
            ),
            "thickness": table_data(check_task.THICKNESSES, check_task.thickness_summaries(gearbox), "gears"),
        },
        "parts": parts_of(gearbox),
    }


def kinematics(gearbox: Gearbox) -> dict[str, Any]:
    """Return the tables of speeds and mesh frequencies at the rated speed or the end of the operating range."""
    case = gearbox.case
    rated = case.operation.rated_speed_rpm
    ends = operating_range(gearbox)
    speed = rated or (ends[1] / RPM if ends else GREATEST_SPEED)
    spins = gearbox.train.rolling_speeds(case.overall.input, speed * RPM)
    speeds = [
        {
            "body": name,
            "speed_rpm": spin / RPM,
            "ratio": spin / (speed * RPM),
            "key": f"bodies.{gearbox.named_bodies[name].family}",
        }
        for name, spin in spins.items()
    ]
    frequencies = gearbox.train.mesh_frequencies(speed * RPM)
    meshes = [
        {
            "mesh": mesh.name,
            "teeth": [mesh.pair.pinion.teeth, mesh.pair.gear.teeth],
            "frequency_Hz": frequencies[mesh.name],
            "order": 60.0 * frequencies[mesh.name] / speed,
            "key": f"meshes.{mesh.family}",
        }
        for mesh in {mesh.family: mesh for mesh in reversed(gearbox.meshes)}.values()
    ]
    which = "rated speed" if rated else "end of the operating range" if ends else "example speed"
    legend = f"At {which}: {significant(speed, 4)} rpm at the input."
    return {
        "speeds": table_data(SPEEDS, speeds, legend=legend),
        "frequencies": table_data(FREQUENCIES, meshes[::-1], legend=legend),
    }


def dynamics(modes: Modes) -> dict[str, Any]:
    """Return the Campbell diagram; the mode shown first is that with the largest share within it."""
    diagram = modes.campbell()
    inside = diagram.seen[modes.frequency[diagram.seen] <= diagram.top]
    first = inside[np.argmax(modes.overall[inside])] if inside.size else np.argmax(modes.overall)
    return {
        "failed": False,
        "model": f"{modes.assembly.variant}, mesh stiffness to ISO 6336-1, rigid bodies",
        "campbell": campbell(modes, diagram),
        "first": int(first),
    }


def loads(assembly: Assembly) -> tuple[dict[str, Any], list[str]]:
    """Return the tables of bearings and meshes under the static load, and warnings about the bearings."""
    state = static_state(assembly) if assembly.variant.has_bearings else None
    duties = bearing_duties(assembly, one_of_a_set=True)
    rows = [{**duty_summary(duty), "key": f"bearings.{duty.family}"} for duty in duties]
    columns = [column for column in bearings_task.BEARINGS if not column.is_detail]
    tables = {
        "bearings": table_data(columns, rows, legend=bearings_task.LEGEND),
        "meshes": table_data(MESHES, _mesh_rows(state) if state else []),
    }
    return tables, [f"bearings.{duty.family}: {remark}" for duty in duties for remark in duty.remarks]


def _mesh_rows(state: StaticState) -> Iterator[dict[str, Any]]:
    """Yield what the static load does to each mesh."""
    for element, distance, tilt, force in zip(
        state.assembly.elements, state.centre_distance, state.misalignment, state.mesh_force, strict=True
    ):
        mesh = element.mesh
        yield {
            "mesh": mesh.name,
            "force_kN": 1e-3 * float(force),
            "misalignment_mrad": 1e3 * float(tilt),
            "opening_um": 1e6 * float(tilt) * mesh.pair.face_width,
            "centre_distance_change_um": 1e6 * (float(distance) - mesh.centre_distance),
            "key": f"meshes.{mesh.family}",
        }


def _mode_table(modes: Modes) -> dict[str, Any]:
    """Return the table of all modes with deflection; the key of a row is the number of its mode, from 0."""
    words = Labels(modes.assembly.gearbox)
    data = modes.to_dataset()
    rows = [
        {
            "number": place + 1,
            "frequency_Hz": float(frequency),
            "damping_percent": 100.0 * float(ratio),
            "shape": words.moves(data, place),
            "key": str(place),
        }
        for place, (frequency, ratio) in enumerate(zip(modes.frequency, modes.damping_ratio, strict=True))
        if frequency > RIGID_BODY_LIMIT
    ]
    return table_data(MODES, rows)


def campbell(modes: Modes, diagram: CampbellDiagram) -> dict[str, Any]:
    """Return the Campbell diagram: frequencies in Hz over the input speed in rpm."""
    gearbox = modes.assembly.gearbox
    ends = operating_range(gearbox)
    return {
        "modes": [
            {
                "mode": int(mode),
                "frequency": rounded(float(modes.frequency[mode]), 6),
                "weight": rounded(float(weight), 3),
            }
            for mode, weight in zip(diagram.seen, diagram.weights, strict=True)
        ],
        "orders": {name: rounded(order, 8) for name, order in diagram.orders.items()},
        "fastest": rounded(diagram.fastest / RPM, 6),
        "top": rounded(diagram.top, 6),
        "range": None if ends is None else [rounded(end / RPM, 6) for end in ends],
        "rated": gearbox.case.operation.rated_speed_rpm,
    }


def motions(modes: Modes, bodies: tuple[DrawnBody, ...]) -> dict[str, Any]:
    """Return how the bodies of the picture move in all modes."""
    shapes = hashlib.sha256(np.ascontiguousarray(modes.shapes).tobytes()).hexdigest()[:16]
    arrays = ArrayStore(f"{shapes}-", level=1)
    stage = motions_data(modes.assembly, tuple(map(_thinned, bodies)), modes.shapes, arrays)
    return {"stage": stage, "arrays": arrays.packed()}


def _thinned(body: DrawnBody) -> DrawnBody:
    """Return a body with a part of its points, which suffices for the largest displacement."""
    points = body.shape.surface.points[::POINTS_OF_A_BODY]
    return replace(body, shape=replace(body.shape, surface=TriangleSurface(points, np.zeros((0, 3), dtype=np.int64))))


def parts_of(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Return key, bodies, position (m) and half axial width (m) of the bodies, gears and bearings, for selection.

    The first position of a planet set's part stands for all of them.
    """
    parts: dict[str, dict[str, Any]] = {}

    def add(key: str, body: str, position: Sequence[float], half: float) -> None:
        known = parts.setdefault(key, {"key": key, "bodies": [], "places": [], "half": rounded(half)})
        known["bodies"].append(body)
        known["places"].append(rounded_list(np.array(position, dtype=np.float64), 6))

    for body in gearbox.bodies():
        add(f"bodies.{body.family}", body.name, (*body.axis, body.centre_of_mass_z), 0.0)
        for gear, z in body.wheels.items():
            add(f"gears.{gear}", body.name, (*body.axis, z), 0.5 * gearbox.gears[gear].face_width)
    for bearing in gearbox.bearings:
        width = bearing.catalogue.width_mm if bearing.catalogue else None
        add(f"bearings.{bearing.family}", bearing.body, bearing.position, 5e-4 * (width or 20.0))
    for mesh in gearbox.meshes:
        for name, wheel in ((mesh.pinion, mesh.pair.pinion), (mesh.gear, mesh.pair.gear)):
            own = gearbox.named_bodies[name]
            for key in (f"meshes.{mesh.family}", f"pairs.{mesh.pair.name}"):
                add(key, name, (*own.axis, own.wheels[wheel.name]), 0.5 * wheel.face_width)
    return list(parts.values())


def table_data(
    columns: Sequence[Column],
    summaries: Iterable[Mapping[str, Any]],
    table: str = "",
    legend: str = "",
) -> dict[str, Any]:
    """Return a table of the terminal for the page.

    Parameters
    ----------
    table : table of the gearbox file that holds the first column's names; by default summaries have a ``key``
    """
    rows = []
    for summary in summaries:
        cells = [column.cell(summary) for column in columns]
        rows.append({"key": f"{table}.{cells[0]}" if table else summary.get("key", ""), "cells": cells})
    return {
        "head": [" ".join(column.heading.replace("-\n", "").split()) for column in columns],
        "texts": [n == 0 or column.is_text for n, column in enumerate(columns)],
        "rows": rows,
        "legend": legend,
    }
