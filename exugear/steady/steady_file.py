"""The file of a steady response: netCDF when it is complete, and the points of one that was stopped."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import operating_range
from exugear.gearbox.units import RPM
from exugear.gearbox.versions import STEADY
from exugear.results.folder import modes_path
from exugear.results.sound.over_speed import sound_variables, surface_words
from exugear.steady.campbell import LAYOUT
from exugear.steady.mean_system.mean_system import Steps
from exugear.steady.mean_system.signals import (
    SURFACE_VELOCITY,
    Quantity,
    carried_seats,
    mount_names,
    quantities_of,
)
from exugear.steady.peaks import line_name
from exugear.steady.settings import SpeedRange, SteadySettings, usual_speeds
from exugear.steady.steady_response import SolvedPoints, SteadyResponse, response_of
from exugear.system.bearings.duty import OperatingPoint
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.build import assemble
from exugear.system.statics import meshes_near_unconverged
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.element import MeshData
from fe_ste.tools.arrays import SingleComplexes
from fe_ste.tools.stores import Layout, Store, load_dataset

if TYPE_CHECKING:
    import xarray as xr

_OVER = {
    "speed": ("point",),
    "index": ("line", "base"),
    "order": ("line",),
    "amplitude": ("point", "line", "signal"),
    "phase": ("point", "line", "signal"),
    "units": ("signal",),
    "drive_torque": ("point",),
    "energy_error": ("point",),
    "growth": ("point",),
    "loads_at_mean_angles": ("point",),
    "remark": ("point",),
    "left_out": ("mesh_wave",),
    "contact_loss_fraction": ("point", "mesh_wave"),
}
"""Dimensions of the variables of a response itself."""
_LAYOUT = Layout(
    "steady-state response",
    STEADY,
    _OVER
    | {"band_point": ("peak",), "band_line": ("peak",), "band_amplitude": ("peak", "quantity", "damping_limit")}
    | {name: (name,) for name in ("quantity", "base", "signal", "mesh_wave")}
    | LAYOUT,
    (
        "gearbox",
        "variant",
        "mesh_model",
        "inertias",
        "method",
        "input_hash",
        "growth_rate",
        "not_converged",
        "harmonics",
        "operating_range",
        "carried_seats",
        "mounts",
    ),
)


def steady_path(folder: str | Path, choice: Choice, settings: SteadySettings) -> Path:
    """Path of the steady-state response of a choice that names its inertia set: next to its modes."""
    return modes_path(folder, choice).with_name(f"steady-{'branch' if settings.branches else settings.method}.nc")


def to_dataset(response: SteadyResponse) -> xr.Dataset:
    """Labelled arrays with units, what `stored_or_computed` writes."""
    import xarray as xr

    solved = response.solved
    amplitude = solved.amplitude
    values: dict[str, tuple[Any, dict[str, str]]] = {
        "speed": (solved.speed, {"units": "rad/s", "long_name": "speed of the overall input"}),
        "index": (response.lines.index, {"units": "1", "long_name": "multiples of the base frequencies"}),
        "order": (response.lines.orders, {"units": "1", "long_name": "periods per input revolution"}),
        "amplitude": (
            np.abs(amplitude).astype(np.float32),
            {"units": "see units", "long_name": "peak amplitude; of line 0 the mean"},
        ),
        "phase": (
            np.angle(amplitude).astype(np.float32),
            {"units": "rad", "long_name": "against cos(order * angle of the input)"},
        ),
        "units": (np.array([signal.units for signal in response.signals], dtype=object), {}),
        "drive_torque": (solved.drive_torque, {"units": "N m"}),
        "energy_error": (solved.energy_error, {"units": "1"}),
        "growth": (solved.growth, {"units": "1/s", "long_name": "largest growth rate of a disturbance"}),
        "loads_at_mean_angles": (
            solved.mean_angles.astype(np.int8),
            {"units": "1", "long_name": "1 where meshes and stated loads are at the angles of the mean speed"},
        ),
        "remark": (solved.remark.astype(object), {}),
        "left_out": (
            response.left_out,
            {"units": "1", "long_name": "fraction of the compliance variation above the harmonics"},
        ),
        "contact_loss_fraction": (solved.apart, {"units": "1", "long_name": "contact-loss fraction"}),
    }
    variables: dict[str, tuple[tuple[str, ...], Any, dict[str, str]]] = {
        name: (over, *values[name]) for name, over in _OVER.items()
    }
    variables |= response.band.variables()
    variables |= response.campbell.variables()
    coordinates: dict[str, Any] = {
        "mesh_wave": np.array(response.wave_names, dtype=object),
        "base": np.array(response.base_names, dtype=object),
        "signal": np.array([signal.name for signal in response.signals], dtype=object),
        "quantity": np.array(response.band.quantities, dtype=object),
    }
    if response.bearing_names:
        words = "fraction of time in which a bearing is unloaded (no rolling element in contact)"
        variables["unloaded_fraction"] = (("point", "bearing"), solved.free, {"units": "1", "long_name": words})
        coordinates["bearing"] = np.array(response.bearing_names, dtype=object)
    if response.radiated is not None:
        velocity = np.abs(amplitude[..., response.signals.index(SURFACE_VELOCITY)]).astype(np.float64)
        more, labels = sound_variables(response.radiated, velocity, solved.speed, response.lines.orders)
        variables |= more
        coordinates |= labels
    return xr.Dataset(variables, coordinates, _attributes(response))


def _attributes(response: SteadyResponse) -> dict[str, Any]:
    """Return the attributes of a response as a whole."""
    assembly = response.assembly
    # A mesh frequency is a multiple of its shafts' rotation by definition.
    unrelated = len(response.base_names) - response.shafts
    linear = _linear_bearings(assembly)
    return {
        "gearbox": assembly.gearbox.name,
        "variant": str(assembly.variant),
        "mesh_model": assembly.mesh_model,
        "inertias": assembly.inertias,
        "method": response.settings.method,
        "settings": json.dumps(asdict(response.settings), sort_keys=True),
        "input_hash": response.input_hash,
        "method_version": STEADY,
        "housing_factor": assembly.housing_factor,
        "bearing_laws": assembly.bearing_laws,
        "bearing_static_loads": json.dumps({name: point.load[:3].tolist() for name, point in linear.items()}),
        "bearing_preloads": json.dumps({name: point.preload for name, point in linear.items()}),
        "mesh_contact": assembly.contacts.description,
        "bearings_in_time": ", ".join(response.bearing_names),
        "growth_rate": response.growth_rate,
        "near_unconverged_states": ", ".join(meshes_near_unconverged(assembly)),
        "planet_spread": response.planet_spread,
        "varying_carrier": ", ".join(response.varying_carriers),
        "load_sharing": json.dumps(response.load_sharing),
        "higher_between": json.dumps([asdict(own) for own in response.higher_between]),
        "neighbours_left_out": response.neighbours_left_out,
        "stiffness_variation": response.stiffness_variation,
        "operating_range": json.dumps(operating_range(assembly.gearbox)),
        "carried_seats": json.dumps(carried_seats(assembly)),
        "mounts": json.dumps(mount_names(assembly)),
        "harmonics": response.harmonics,
        "change_with_more": response.change_with_more,
        "shared_lines": "; ".join(_shared(row, response.base_names) for row in response.lines.shared(unrelated)),
        "contributions": json.dumps([{"line": line, **asdict(parts)} for line, parts in response.contributions]),
        "sound_contributions": json.dumps(
            [{"line": line, **asdict(parts)} for line, parts in response.sound_contributions]
        ),
        "folds": json.dumps(response.folds),
        "branch_ended": response.branch_ended,
        "not_converged": json.dumps([{"speed": speed, "reason": reason} for speed, reason in response.unsolved]),
        "crossings": json.dumps([asdict(crossing) for crossing in response.crossings]),
        **({} if response.radiated is None else {"radiating_surface": surface_words(response.radiated)}),
    }


def _linear_bearings(assembly: Assembly) -> dict[str, OperatingPoint]:
    """Operating points of the bearings that are linear about their static load, where this stands still and is one."""
    return {
        point.bearing.name: point
        for point in assembly.operating_points
        if point is not None
        and point.bearing.model != "iso16281"
        and point.load_stands_still
        and not point.is_unloaded
        and point.bearing.on not in assembly.spin
    }


def _shared(multiples: tuple[int, ...], bases: tuple[str, ...]) -> str:
    """Two multiples of bases that are one frequency, by their names."""
    names = [f"{abs(n)} x {base.split(', ')[0]}" for n, base in zip(multiples, bases, strict=False) if n]
    return " = ".join(names)


def load_response(path: str | Path) -> xr.Dataset:
    """Read what `stored_or_computed` wrote.

    Raises
    ------
    FileError
        The file is missing, damaged, or of another version.

    Examples
    --------
    >>> load_response("nowhere/steady-parametric.nc")
    Traceback (most recent call last):
    fe_ste.tools.files.FileError: nowhere/steady-parametric.nc: no such file
    """
    return with_names(load_dataset(Path(path), _LAYOUT))


def response_quantities(data: xr.Dataset) -> tuple[Quantity, ...]:
    """Return the quantities that describe a stored response, made of its signals."""
    return quantities_of([str(name) for name in data["signal"].to_numpy()], json.loads(str(data.attrs["mounts"])))


def complex_amplitudes(data: xr.Dataset, signals: Sequence[int] | None = None) -> SingleComplexes:
    """Return the complex amplitudes (points, lines, signals) of a stored response, all or some; of line 0 the mean."""
    some = slice(None) if signals is None else list(signals)
    phase = data["phase"].to_numpy()[..., some]
    size = data["amplitude"].to_numpy()[..., some]
    found = np.empty(size.shape, dtype=np.complex64)
    for out, own, angle in zip(found, size, phase, strict=True):  # point by point: temporary arrays stay in the cache
        out.real = own * np.cos(angle)
        out.imag = own * np.sin(angle)
    return found


def with_names(data: xr.Dataset) -> xr.Dataset:
    """Add what follows from other arrays: names of the lines, and the speed of the overall input in rpm."""
    bases = tuple(str(name) for name in data["base"].to_numpy())
    names = [line_name(tuple(int(n) for n in multiples), bases) for multiples in data["index"].to_numpy()]
    speed = ("point", data["speed"].to_numpy() / RPM, {"units": "rpm", "long_name": "speed of the overall input"})
    return data.assign_coords(line=np.array(names, dtype=object), speed_rpm=speed)


def steady_response(
    gearbox: Gearbox,
    choice: Choice,
    stiffness: Mapping[str, MeshData],
    bodies: Mapping[str, ElasticBody] | None = None,
    settings: SteadySettings | None = None,
) -> xr.Dataset:
    """Compute the steady-state response of a gearbox variant under its static load, over speeds of the overall input.

    Parameters
    ----------
    choice : variant, mesh model and inertia set
    stiffness : mapping of pair name to (n,) array
        Mesh stiffness F_bt / STE over the cycle, N/m.
    bodies : by body name, reduced flexible bodies, required by the variant `flexible`
    settings : speeds and method; by default the speeds of the first load case, and `parametric`

    Returns
    -------
    labelled as that of `load_response`

    Raises
    ------
    SteadyError
        The case cannot be treated; the message gives the reason.
    BalanceError
        The static load has no equilibrium.

    Examples
    --------
    >>> import numpy as np
    >>> from exugear import Choice, Gearbox, SpeedRange
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> shape = 1.0 + 0.05 * np.cos(2.0 * np.pi * np.arange(50) / 50)
    >>> mean = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> stiffness = {name: value * shape for name, value in mean.items()}
    >>> settings = SteadySettings(SpeedRange.from_text("10:20:3"), at_resonances=False)
    >>> response = steady_response(gearbox, Choice("rigid"), stiffness, settings=settings)
    >>> response["amplitude"].sel(signal="overall_dte", line="2 x high_speed").sizes
    Frozen({'point': 3})
    >>> response["speed_rpm"].to_numpy().round(1)
    array([10., 15., 20.])
    """
    assembly = assemble(gearbox, choice, stiffness, bodies)
    response = response_of(assembly, settings or SteadySettings(usual_speeds(gearbox)))
    return with_names(to_dataset(response))


def stored_or_computed(
    path: Path,
    assembly: Assembly,
    settings: SteadySettings,
    progress: Callable[[int, int], None] | None = None,
    prepared: Steps | None = None,
) -> xr.Dataset:
    """Read the response of an assembly at `path` if it exists and matches; else compute and write it.

    Points of a stopped computation are reused; a computation stopped again keeps its points.
    """
    store = Store(path, settings.hash_with(assembly))
    points = Store(partial_path(path), store.key)
    stored = store.read_dataset(_LAYOUT)
    if stored is None:
        response = response_of(
            assembly,
            settings,
            known=points.read(lambda arrays: SolvedPoints(**arrays)),
            progress=progress,
            keep=lambda solved: points.write(vars(solved)),
            prepared=prepared,
        )
        store.write_dataset(to_dataset(response))
        points.discard()
        stored = load_dataset(path, _LAYOUT)
    return with_names(stored)


def settings_of(attributes: Mapping[str, Any]) -> SteadySettings:
    """Read the settings that a file was computed with from its attributes.

    Raises
    ------
    ValueError
        They are none.
    """
    try:
        content = json.loads(str(attributes["settings"]))
        return SteadySettings(**{**content, "speeds": SpeedRange(**content["speeds"])})
    except (KeyError, TypeError) as error:
        raise ValueError(f"its settings cannot be read ({error})") from None


def partial_path(path: Path) -> Path:
    """Place of the points of a response that is not complete."""
    return path.with_suffix(".partial.npz")
