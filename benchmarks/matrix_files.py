"""What matrices of other programs cost: writing, reading, checks, and the reduced body, by format.

Run by ``OMP_NUM_THREADS=1 python benchmarks/matrix_files.py [NODES]``, separately from the others. The body has as many
nodes as the housing of the GRC and 17 modal coordinates unless another number of nodes is given. Medians of processor
time.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import get_args

import numpy as np

from exugear.system.bodies.external import ExternalModel, NodeSeat, matrices_of, reduce_external
from exugear.system.bodies.matrix_files.checks import review
from exugear.system.bodies.matrix_files.files import MatrixFiles, MatrixFormat, file_contents, keys_of, read_matrices
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices

ROUNDS = 5
MODES = 17
FIRST_MODE_HZ = 300.0


def free_body(nodes: int) -> InterfaceMatrices:
    """Body of lumped masses with random stiffness that rigid motions do not strain."""
    random = np.random.default_rng(1)
    size = 6 * nodes + MODES
    places = random.uniform(-0.5, 0.5, (nodes, 3))
    modal = tuple(range(900_001, 900_001 + MODES))
    mass = np.diag(np.concatenate([np.tile([50.0] * 3 + [2.0] * 3, nodes), np.ones(MODES)]))
    numbers = tuple(range(1, nodes + 1))
    rigid = InterfaceMatrices(numbers, places, modal, mass, mass).rigid_motions((0.0, 0.0, 0.0))
    deforming = np.eye(size) - rigid @ np.linalg.pinv(rigid)
    scale = np.sqrt(np.diag(mass)) * 2.0 * np.pi * FIRST_MODE_HZ
    spread = random.normal(size=(size, size)) / np.sqrt(size)
    elastic = scale[:, None] * (np.eye(size) + 0.1 * spread @ spread.T) * scale
    stiffness = deforming.T @ elastic @ deforming
    return InterfaceMatrices(numbers, places, modal, mass, 0.5 * (stiffness + stiffness.T))


def median_ms(work: Callable[[], object]) -> float:
    """Median processor time of `ROUNDS` calls, ms."""
    times = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        work()
        times.append(1e3 * (time.process_time() - begin))
    return statistics.median(times)


def main() -> None:
    """Print a table of all formats."""
    nodes = int(sys.argv[1]) if len(sys.argv) > 1 else 18
    body = free_body(nodes)
    errors = review(body).errors
    if errors:
        raise SystemExit(f"the body of the benchmark is not free: {errors[0]}")
    print(f"{nodes} nodes, {MODES} modal coordinates, {body.size} coordinates")
    print("| format | size, kB | write, ms | read, ms | checks, ms | reduced body, ms |")
    print("| --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for form in get_args(MatrixFormat):
            contents = file_contents(body, "body", form)
            for name, content in contents.items():
                (Path(folder) / name).write_bytes(content)
            files = MatrixFiles(**{key: Path(folder) / name for key, name in keys_of("body", form).items()})
            seats = tuple(NodeSeat(f"seat_{n}", (0.0, 0.0, 0.0), n) for n in body.nodes)
            axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
            model = ExternalModel("body", files, "SI", axes, (0.0, 0.0, 0.0), seats, "ground", 4500.0, 9000.0)
            matrices_of(model)  # kept: the reduced body is timed without reading
            found = matrices_of(model)[0]
            cells = (
                sum(map(len, contents.values())) / 1e3,
                median_ms(lambda form=form: file_contents(body, "body", form)),
                median_ms(lambda files=files: read_matrices(files)),
                median_ms(lambda found=found: review(found)),
                median_ms(lambda model=model: reduce_external(model)),
            )
            print(f"| {form} | " + " | ".join(f"{cell:.3g}" for cell in cells) + " |")


if __name__ == "__main__":
    main()
