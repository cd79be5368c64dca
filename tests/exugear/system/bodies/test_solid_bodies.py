"""Solids in the gearbox file and in the variant `flexible`: an elastic housing on its mounts."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import Permissions
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.variant import VariantError
from exugear.report.pictures.scene import elastic_scene
from exugear.system.bodies.of_gearbox import reduced_bodies, solid_body
from exugear.system.bodies.solid_elements import assemble as assemble_solid
from exugear.system.bodies.solid_elements import seat_rows
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.modes import BODY_MOTIONS, counterparts, eigenmodes, modes_of
from exugear.system.signals import energy_residual
from exugear.system.statics import accelerating_start, linearise, locked_equilibrium
from exugear.system.system import Assembly, input_hash
from exugear.transient.compiled.solver import CompiledSystem
from fe_ste.elimination import factorise

from ....optional_libraries import needs_gmsh, needs_meshio, works
from ...cases.assembled import assembled, bodies_of, modes_with_bodies, simulated
from ...cases.both_ways import assert_matrices_of_exudyn_are_those_of, compiled_states, exudyn_states, relative_error
from ...cases.box import box_content
from ...cases.limit import unchecked
from ...cases.plain_motion import accelerations_of
from ...cases.plain_signals import sampled
from ...cases.reduced import first_coordinate

pytestmark = needs_meshio

STIFFNESS = {"spur": 2e8 * (1.0 + 0.1 * np.cos(2.0 * np.pi * np.arange(16) / 16))}
LOAD = {"shaft_1": 100.0, "shaft_2": 140.0}
STEP = 5e-6


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> Gearbox:
    folder = tmp_path_factory.mktemp("box")
    return Gearbox.from_dict(box_content(folder), str(folder / "case.toml"))


@pytest.fixture(scope="module")
def housed(box: Gearbox) -> Assembly:
    return assembled(box, Choice("flexible"), STIFFNESS)


def moving(assembly: Assembly) -> tuple[np.ndarray, np.ndarray]:
    """Preloaded state at 5 rad/s, all coordinates and rates moved at random."""
    start = accelerating_start(assembly, LOAD, 5.0)
    random = np.random.default_rng(7)
    return start.q + 1e-6 * random.normal(size=assembly.size), start.v + 1e-2 * random.normal(size=assembly.size)


def test_seats_of_the_housing_give_way_as_those_of_the_whole_model(box: Gearbox, housed: Assembly) -> None:
    # Second way: every unknown of the finite elements, the foot as a spring on its seat, loads on both bearing seats.
    model = solid_body(box, "box").model
    solid = assemble_solid(model.elements, model.material)
    rows = seat_rows(solid, model.seats)
    spring = np.zeros((18, 18))
    arm = np.eye(6)
    arm[0, 4], arm[1, 3] = -0.028, 0.028  # the support is 28 mm below the seat
    spring[12:, 12:] = arm.T @ np.diag([5e7, 5e7, 5e7, 1e5, 1e5, 1e5]) @ arm
    held = solid.stiffness + scipy.sparse.csr_array(rows.T) @ scipy.sparse.csr_array(spring @ rows)
    with factorise(scipy.sparse.csr_array(held)) as factors:
        whole = rows @ factors.solve(np.ascontiguousarray(rows[:12].T))
    linear = linearise(housed, np.zeros(housed.size))
    place = housed.elastic_slices["box"]
    reduced = (linear.stiffness["box_body"] + linear.stiffness["foot"])[place, place]
    found = np.linalg.inv(reduced)[:18, :12]
    scale = np.sqrt(np.outer(whole.diagonal().repeat(1)[:12], whole.diagonal()[:12]))
    # The connector's tangent is a difference quotient; static deflections are exact by construction.
    assert np.abs((found[:12] - whole[:12]) / scale).max() < 1e-6
    rigid = np.linalg.inv(arm.T @ np.diag([5e7, 5e7, 5e7, 1e5, 1e5, 1e5]) @ arm)
    assert whole[2, 2] > 1.5 * rigid[2, 2]  # the plate itself gives way, too


def test_a_stiffer_housing_tends_to_one_that_is_the_ground(box: Gearbox) -> None:
    # On the ground its bearings have no factor: the seats that it stood for are rigid.
    rigid = eigenmodes(box.varied({"housing.factor": 1.0}), Choice("bushing"), STIFFNESS)
    gaps = []
    for factor in (1e3, 1e4):
        mounts = {
            f"mounts.foot.stiffness.{key}": 50.0 * factor * value
            for key, value in box.content["mounts"]["foot"]["stiffness"].items()
        }
        stiff = unchecked(
            box.varied({"elasticity.band_Hz": 5e4, "elasticity.limit_Hz": 1e6}),
            {
                **mounts,
                "bodies.box.solid.material.youngs_modulus_GPa": 206.0 * factor,
                "elasticity.limit_Hz": 1e8,
            },
        )
        found = modes_with_bodies(stiff, Choice("flexible"), STIFFNESS)
        place, share = counterparts(rigid, found)
        assert share[1:].min() > 0.8  # modes a few Hz apart mix
        gaps.append(np.abs(found.frequency[place][1:] / rigid.frequency[1:] - 1.0).max())
    assert gaps[1] < 0.002
    assert gaps[1] == pytest.approx(gaps[0] / 10, rel=0.05)  # compliance in series: first order


def test_the_housing_factor_is_for_housings_that_are_the_ground(box: Gearbox, housed: Assembly) -> None:
    ground = assemble(box, Choice("bushing"), STIFFNESS)
    assert ground.connector_names == ("bearing_1", "bearing_2")
    assert housed.connector_names == ("bearing_1", "bearing_2", "foot")
    assert np.allclose(ground.connectors.stiffness, 0.5 * housed.connectors.stiffness[:2])
    assert not ground.elastic_bodies
    assert (ground.housing_factor, housed.housing_factor) == (0.5, 1.0)
    assert (ground.connectors.bodies[:, 0] == -1).all()


def test_a_housing_neither_turns_nor_has_gyroscopic_forces(housed: Assembly) -> None:
    assert set(housed.spin) == {"shaft_1", "shaft_2"}
    body = housed.elastic_bodies["box"].reduced
    assert body.frame == "ground"
    assert not body.spin.any()
    assert not body.gyroscopic.any()
    speeds = {"shaft_1": 30.0, "shaft_2": -20.0}
    assert not housed.rolling_velocity(np.zeros(housed.size), speeds)[housed.elastic_slices["box"]].any()
    with pytest.raises(VariantError, match="no rotating body 'box' to load; bodies are"):
        housed.torque_vector({"box": 1.0})


def test_weight_and_mass_of_a_housing_are_those_of_its_solid(box: Gearbox) -> None:
    heavy = assembled(box.varied({"gravity.acceleration_m_per_s2": [0.0, -9.81, 0.0]}), Choice("flexible"), STIFFNESS)
    mass = 7850.0 * 0.125 * 0.05 * 0.012
    body, place = heavy.elastic_bodies["box"], heavy.elastic_slices["box"]
    assert body.shape_inertia.mass == pytest.approx(mass, rel=1e-9)
    assert body.shape_inertia.centre == pytest.approx((0.0375, 0.0, -0.006), abs=1e-9)
    down = body.reduced.rigid_motions((0.0, 0.0, 0.0))[:, 1]
    assert down @ heavy.constant_forces[place] == pytest.approx(-9.81 * mass, rel=1e-9)
    q = locked_equilibrium(heavy, {}, ["shaft_2"], heavy.mean_meshes)
    loads = heavy.bearing_loads(q, np.zeros(heavy.size))
    # The foot carries the plate and both shafts (1 and 2 kg).
    assert abs(loads[heavy.connector_names.index("foot"), 1]) == pytest.approx(9.81 * (mass + 3.0), rel=1e-6)


def test_modes_tell_of_the_housing(housed: Assembly) -> None:
    modes = modes_of(housed)
    assert np.allclose(modes.kinetic.sum(axis=(1, 2)), 1.0)
    assert modes.kinetic.min() >= 0.0
    assert any("strain energy: box itself" in name for name in modes.names)
    assert any("strain energy: foot" in name for name in modes.names)
    assert any(name.startswith("box radial") for name in modes.names)
    names = [body.name for body in housed.bodies]
    shares = modes.kinetic[:, names.index("box")].max(axis=0)
    assert shares[BODY_MOTIONS.index("deformation")] > 0.05
    assert shares[[BODY_MOTIONS.index(motion) for motion in ("bending", "twist", "stretch")]].max() == 0.0
    scene = elastic_scene(housed, modes.shapes[:, 3])
    assert len(scene.bodies) == 1
    assert not scene.gears


def test_matrices_of_exudyn_are_those_of_the_assembly(housed: Assembly) -> None:
    # The assembly's bearings are difference quotients.
    assert_matrices_of_exudyn_are_those_of(housed, np.zeros(housed.size), 1e-9)


def test_the_compiled_solver_follows_exudyn_and_the_plain_kernels(housed: Assembly) -> None:
    q, v = moving(housed)
    system = CompiledSystem(housed, q, v, LoadTable(LOAD), STEP)
    plain = accelerations_of(housed, q, v, housed.torque_vector(LOAD))
    assert np.abs(system.accelerations() - plain).max() < 1e-9 * np.abs(plain).max()
    found, expected = (
        sampled(housed, *states(housed, q, v, LOAD, 400, STEP)) for states in (compiled_states, exudyn_states)
    )
    assert relative_error(found, expected) < 1e-5


def test_work_of_the_loads_is_accounted_for(box: Gearbox, tmp_path: Path) -> None:
    run = simulated(box, Choice("flexible", load_case="run_up"), STIFFNESS, tmp_path, duration=0.05)
    data = xr.load_dataset(run.path, engine="h5netcdf")
    # Everything is accounted for, so only the quadrature of the powers is left.
    assert abs(energy_residual(data)) < 1e-6
    assert list(data.support.values) == ["bearing_1", "bearing_2", "foot"]


def test_the_reduction_of_a_solid_is_stored_under_its_body(box: Gearbox, tmp_path: Path) -> None:
    bodies_of(box, Choice("flexible"), tmp_path)
    assert [file.name.split("-")[0] for file in tmp_path.iterdir()] == ["box"]


PLATE = """
SetFactory("OpenCASCADE");
plate = newv; Box(plate) = {-40, -40, -20, 160, 80, 20};
bores() = {};
For n In {0:1}
  bore = newv; Cylinder(bore) = {n * 75, 0, -21, 0, 0, 22, 15}; bores() += {bore};
EndFor
BooleanDifference{ Volume{plate}; Delete; }{ Volume{bores()}; Delete; }
"""


@pytest.mark.validation
@needs_gmsh
def test_a_script_step_and_its_mesh_are_the_same_body(tmp_path: Path) -> None:
    # STEP is the same geometry, whose edges gmsh may take up in another order; the mesh is the script's own.
    box = Gearbox.from_dict(box_content(tmp_path), str(tmp_path / "case.toml"), Permissions(scripts=True))
    gmsh: Any = importlib.import_module("gmsh")
    (tmp_path / "plate.geo").write_text(PLATE, encoding="utf-8")
    gmsh.initialize(["test", "-nopopup"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "plate.geo"))
        gmsh.model.occ.synchronize()
        gmsh.write(str(tmp_path / "plate.step"))
        gmsh.write(str(tmp_path / "plate.brep"))
        gmsh.option.setNumber("Mesh.MeshSizeMax", 20.0)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 8)
        gmsh.model.mesh.setSize(gmsh.model.getEntities(0), 20.0)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.model.mesh.optimize("HighOrder")
        gmsh.option.setNumber("Mesh.SaveAll", 1)
        gmsh.write(str(tmp_path / "plate.msh"))
    finally:
        gmsh.finalize()
    bore = {"diameter_mm": 30.0, "width_mm": 20.0}
    bodies = {}
    for file in ("plate.geo", "plate.step", "plate.brep", "plate.msh"):
        solid = {"file": file, "element_size_mm": 20.0, "elements_around": 8, "seats": {}}
        for name, x in (("bearing_1", 0.0), ("bearing_2", 75.0), ("foot", 75.0)):
            solid["seats"][name] = {**bore, "position_mm": [x, 0.0, -10.0]}
        solid["seats"]["foot"] = {"same_as": "bearing_2"}
        bodies[file] = reduced_bodies(box.varied({"bodies.box.solid": solid}), "disc")["box"]
    script = bodies.pop("plate.geo")
    volume = 0.16 * 0.08 * 0.02 - 2 * np.pi * 0.015**2 * 0.02
    # Circles are eight parabolas: their area is 8e-4 off, and is a ninth of the plate's.
    assert script.shape_inertia.mass == pytest.approx(7850.0 * volume, rel=1.5e-4)
    assert script.shared_seats == {"foot": "bearing_2"}
    for file, body in bodies.items():
        tolerance = 1e-9 if file == "plate.msh" else 0.01
        assert body.shape_inertia.mass == pytest.approx(script.shape_inertia.mass, rel=1e-5)
        assert body.reduced.stiffness[:12, :12].diagonal() == pytest.approx(
            script.reduced.stiffness[:12, :12].diagonal(), rel=tolerance
        )


def test_a_gear_in_sectors_has_a_seat_for_each(box: Gearbox) -> None:
    solid = dict(box.content["bodies"]["box"]["solid"])
    wheel = {"sectors": 3, "diameter_mm": 40.0, "width_mm": 8.0}
    with_wheel = solid | {"seats": solid["seats"] | {"wheel": wheel}}
    case = box.varied({"bodies.box.gears_z_mm": {"wheel": -6.0}, "bodies.box.solid": with_wheel})
    found = solid_body(case, "box")
    assert found.sectors == {"wheel": ("wheel_1", "wheel_2", "wheel_3")}
    assert [seat.name for seat in found.model.seats][:3] == list(found.sectors["wheel"])
    assert [seat.sector for seat in found.model.seats[:3]] == [(n * 2 * np.pi / 3, 2 * np.pi / 3) for n in range(3)]
    with pytest.raises(GearboxFileError, match=r"seats\.foot\.sectors = 3: only the seat of a gear has sectors"):
        foot = solid["seats"]["foot"] | {"sectors": 3}
        solid_body(box.varied({"bodies.box.solid": solid | {"seats": solid["seats"] | {"foot": foot}}}), "box")
    with pytest.raises(GearboxFileError, match="sectors must be odd"):
        box.varied({"bodies.box.solid.seats.wheel": {"sectors": 4}})


@needs_gmsh
@pytest.mark.long
def test_the_grc_stands_on_its_mounts_with_elastic_housing(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    # Second way: equilibrium of the whole gearbox. What goes in and does not come out is held by the trunnions' couple.
    assembly = assembled(grc, Choice("flexible"), stiffness, folder=tmp_path / "bodies")
    load = grc.case.static_load
    q = locked_equilibrium(assembly, load.torques_N_m, load.locked, assembly.mean_meshes)
    loads = assembly.bearing_loads(q, np.zeros(assembly.size))
    left, right, shaft = (
        loads[assembly.connector_names.index(n)] for n in ("arm_left", "arm_right", "main_shaft_support")
    )
    held = abs(0.9 * (right[1] - left[1]))
    # Mounts tilt with the housing (5 mrad), and couples of second order go with that.
    assert held == pytest.approx(240e3 * (1.0 - 1.0 / grc.train.ratio), rel=1e-4)
    assert np.abs((left + right + shaft)[:3]).max() < 1e-4 * np.abs(left[1])
    # The published finite-element analysis of the real rear housing has tilts of 0.12 to 0.54 mrad at 401 kN m.
    housing, place = assembly.elastic_bodies["housing"].reduced, assembly.elastic_slices["housing"]
    tilts = [
        np.hypot(*q[place][first_coordinate(housing, name) + 3 : first_coordinate(housing, name) + 5])
        for name in ("lss_bc", "ims_bc", "hss_bc")
    ]
    assert 1e-4 < max(tilts) < 1e-3
    run = simulated(grc, Choice("flexible", load_case="generating"), stiffness, tmp_path, duration=0.02)
    assert abs(energy_residual(xr.load_dataset(run.path, engine="h5netcdf"))) < 1e-6


def test_results_know_the_file_of_a_solid(box: Gearbox, housed: Assembly, tmp_path: Path) -> None:
    before = input_hash(housed)
    content = box_content(tmp_path)
    same = Gearbox.from_dict(content, str(tmp_path / "case.toml"))
    assert input_hash(assembled(same, Choice("flexible"), STIFFNESS)) == before
    text = (tmp_path / "plate.vtu").read_bytes()
    (tmp_path / "plate.vtu").write_bytes(text + b"\n")
    assert input_hash(assembled(same, Choice("flexible"), STIFFNESS)) != before


def test_faults_name_body_key_and_what_would_be_right(tmp_path: Path, monkeypatch: Any) -> None:
    box = Gearbox.from_dict(box_content(tmp_path), str(tmp_path / "case.toml"))
    for name in ("plate.step", "plate.xdmf"):
        (tmp_path / name).write_text("no STEP", encoding="utf-8")

    def refused(changes: dict[str, Any], match: str) -> None:
        with pytest.raises((GearboxFileError, VariantError), match=match):
            assembled(box.varied(changes), Choice("flexible"), STIFFNESS)

    solid, seats = "bodies.box.solid", box.content["bodies"]["box"]["solid"]["seats"]
    refused({f"{solid}.file": "none.vtu"}, r"bodies\.box\.solid\.file = 'none\.vtu': no such file")
    refused(
        {f"{solid}.file": "plate.xdmf"}, r"solid\.file = 'plate\.xdmf': unknown format; .* must end in \.geo, \.step, "
    )
    refused({f"{solid}.file": "plate.step"}, r"bodies\.box\.solid\.element_size_mm: this key is missing")
    needs = r"seats\.bearing_1: bearing 'bearing_1' requires its position and size; set diameter_mm and width_mm"
    refused({f"{solid}.seats": {}}, needs)
    refused({f"{solid}.seats": seats | {"lid": {"diameter_mm": 5.0}}}, r"seats\.lid: .* set width_mm and position_mm")
    moved = seats["bearing_1"] | {"position_mm": [0.0, 0.0, 3.0]}
    refused({f"{solid}.seats.bearing_1": moved}, r"bodies\.box\.solid: seat bearing_1: no face of the mesh lies on it")
    refused({f"{solid}.seats.foot": {"same_as": "feet"}}, r"foot\.same_as = 'feet': no such seat; seats are bearing_1")
    refused(
        {f"{solid}.seats.foot": {"same_as": "bearing_1", "width_mm": 3.0}},
        "same_as cannot be combined with other keys: the dimensions of the other seat apply",
    )
    blank = {"mass_kg": 1.0, "axial_kg_m2": 1.0, "transverse_kg_m2": 1.0}
    refused({f"{solid}.blanks": {"lid": blank}}, r"blanks\.lid: no such seat; seats are bearing_1, bearing_2, foot")
    refused({f"{solid}.torque_seat": "lid"}, r"torque_seat = 'lid': no such seat")
    refused({f"{solid}.band_Hz": 2e4}, ".band_Hz = 20000: must be below elasticity.limit_Hz")
    refused({"mounts": {}}, "body box is flexible, but nothing supports it; add")
    refused({"mounts.foot.body": "shaft_9"}, r"mounts\.foot: no body 'shaft_9'")
    refused({"mounts.bearing_1": box.content["mounts"]["foot"]}, "also a name in .bearings")
    refused({"bodies.box.flexibility": "nonrotating"}, "is for rotating bodies; set 'elastic' for a fixed body")
    refused({"bodies.box.flexibility": "none"}, "no flexible body is defined; add")
    shape = {"start_z_mm": 0.0, "sections": [{"length_mm": 10.0, "outer_diameter_mm": 10.0}]}
    refused({"bodies.box.shape": shape}, "set one of shape, solid and external")
    if works("gmsh"):
        refused({f"{solid}.file": "plate.step", f"{solid}.element_size_mm": 20.0}, r"plate\.step: gmsh cannot")

    def missing(name: str) -> Any:
        raise ModuleNotFoundError(name)

    monkeypatch.setattr("exugear.system.bodies.solid_files.importlib.import_module", missing)
    refused({f"{solid}.length_unit_mm": 1.001}, r"meshio is not installed: pip install 'exugear\[mesh\]'")


@pytest.mark.parametrize(
    ("stated", "rates"),
    [({"loss_factor": 0.04}, lambda w: 0.04 * w), ({"damping_time_s": 2e-6}, lambda w: 2e-6 * w**2)],
)
def test_a_solid_has_the_damping_that_its_keys_state(tmp_path, stated, rates):
    """In each free mode of unit modal mass: eta w for structural damping, beta w^2 for C = beta K."""
    content = box_content(tmp_path)
    content["bodies"]["box"]["solid"] |= stated
    content["damping"] = {"bearing_time_s": 0.0, "mesh_time_s": 0.0, "body_time_s": 5e-6}
    gearbox = Gearbox.from_dict(content, str(tmp_path / "case.toml"))
    assembly = assembled(gearbox, Choice("flexible"), {"spur": np.full(50, 3e8)})
    at = assembly.elastic_slices["box"]
    total = linearise(assembly, np.zeros(assembly.size)).total_damping[at, at]
    body = assembly.elastic_bodies["box"].reduced
    squares, shapes = scipy.linalg.eigh(body.stiffness, body.mass)
    wanted = rates(np.sqrt(squares[6:]))
    assert shapes[:, 6:].T @ total @ shapes[:, 6:] == pytest.approx(np.diag(wanted), abs=1e-6 * wanted.max())


def test_damping_of_a_solid_is_stated_once_and_by_modes_only_of_a_fixed_body(tmp_path):
    content = box_content(tmp_path)
    content["bodies"]["box"]["solid"] |= {"loss_factor": 0.04, "damping_time_s": 1e-6}
    with pytest.raises(GearboxFileError, match=r"bodies\.box\.solid.*set either loss_factor or damping_time_s"):
        Gearbox.from_dict(content, str(tmp_path / "case.toml"))
    del content["bodies"]["box"]["solid"]["damping_time_s"]
    content["bodies"]["box"]["fixed"] = False
    with pytest.raises(GearboxFileError, match=r"solid\.loss_factor: damping ratios of single modes"):
        Gearbox.from_dict(content, str(tmp_path / "case.toml"))
