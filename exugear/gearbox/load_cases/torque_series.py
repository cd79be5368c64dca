"""Torques over time of a load case, from a CSV file beside the gearbox file."""

from __future__ import annotations

import csv

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import LoadCase
from exugear.gearbox.reading import CaseError, fault_line, shortened
from fe_ste.tools.arrays import Floats


def torque_series(gearbox: Gearbox, case: LoadCase) -> dict[str, tuple[Floats, Floats]]:
    """Read times (s) and torques (N m) by body from the case's CSV file.

    The header is ``time_s`` and one ``<body>_N_m`` per loaded body; between lines torques are linear.

    Returns
    -------
    mapping of body name to (times, torques), each (lines,); empty without a file.

    Raises
    ------
    CaseError
        A file that cannot be read, unknown columns, text where numbers belong, times that do not grow.
    """
    if case.torque_series is None:
        return {}

    def fault(text: str) -> CaseError:
        return CaseError(fault_line(str(case.torque_series), text))

    try:
        with case.torque_series.open(newline="", encoding="utf-8-sig") as file:
            lines = [line for line in csv.reader(file) if line]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise fault(f"cannot be read as CSV ({error})") from None
    if len(lines) < 3 or lines[0][0].strip() != "time_s":
        raise fault("expected a header time_s,BODY_N_m,... and at least two lines of numbers")
    try:
        table = np.array([[float(cell) for cell in line] for line in lines[1:]])
    except ValueError as error:
        raise fault(f"{error}; every line needs {len(lines[0])} numbers") from None
    if table.ndim != 2 or table.shape[1] != len(lines[0]) or not np.all(np.isfinite(table)):
        raise fault(f"every line needs {len(lines[0])} finite numbers")
    if not np.all(np.diff(table[:, 0]) > 0.0):
        raise fault("time_s must grow from line to line")
    series = {}
    for column, name in enumerate(lines[0][1:], start=1):
        body = name.strip().removesuffix("_N_m")
        if body not in gearbox.spinning or not name.strip().endswith("_N_m"):
            known = ", ".join(f"{known}_N_m" for known in gearbox.spinning)
            raise fault(f"column {shortened(name.strip())} is no torque of a body; columns are {known}")
        series[body] = (table[:, 0], table[:, column])
    return series
