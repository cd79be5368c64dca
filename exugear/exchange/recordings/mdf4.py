"""Measurement data format (ASAM MDF 3 and 4) by asammdf, an optional library, in a process of its own.

A damaged file can hang or exhaust that library, since its blocks point to each other by addresses. The process that
reads it therefore has limits of time and of memory, and hands over plain arrays in a folder that is deleted. Formulas
in the file (algebraic conversions) would be evaluated by the library; channels with one are refused.
"""

from __future__ import annotations

import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from exugear.exchange.recordings.recording import (
    FEWEST_SAMPLES,
    RecordedChannel,
    Recording,
    RecordingError,
    check_sizes,
    common_rate,
    even_rate,
    floats,
    places_of,
    recording_of,
)
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import open_regular

SHORTEST_LIMIT = 60.0
"""Time that reading may take, s; libraries are loaded within it."""
SLOWEST_RATE = 2e6
"""Bytes of the file per further second; asammdf reads hundred times as many."""
MEMORY_LIMIT = 4_000_000_000
"""Memory that reading may take beside 12 times the size of the file, bytes."""
_ALGEBRAIC = 3
_MOST_CHANNELS = 10_000


def read_mdf(path: Path, wanted: Sequence[str] | None = None, limit: float = SHORTEST_LIMIT) -> Recording:
    """Channels of an MDF file; if a name is in several groups, it is ``GROUP/NAME`` with the number of the group.

    Parameters
    ----------
    wanted : names of the channels; by default all numbers that have as many samples as the longest
    limit : time that a small file may take, s

    Raises
    ------
    RecordingError
        asammdf is missing; the file is damaged, truncated, has a formula, or takes too long.
    """
    with open_regular(path) as file:
        if file.read(8)[:3] not in (b"MDF", b"UnF"):
            raise RecordingError(f"{path}: does not begin as an MDF file; check the extension")
        size = os.fstat(file.fileno()).st_size
    if importlib.util.find_spec("asammdf") is None:
        raise RecordingError(
            f"{path}: MDF files need asammdf: pip install 'exugear[mdf]'; or export the channels as .csv, .unv or .h5"
        )
    with tempfile.TemporaryDirectory(prefix="exugear-") as folder:
        content = _in_another_process(path, wanted, Path(folder), limit + size / SLOWEST_RATE, size)
        names = [str(own["name"]) for own in content]
        axes: dict[str, tuple[float, float]] = {}
        for own in content:
            if own["time"] not in axes:
                time = _array(path, Path(folder), own["time"])
                axes[own["time"]] = even_rate(path, time), float(time[0])
        rate = common_rate(path, names, [axes[own["time"]][0] for own in content])
        channels = [
            RecordedChannel(name, str(own["unit"]), _array(path, Path(folder), own["values"]))
            for name, own in zip(names, content, strict=True)
        ]
        return recording_of(path, rate, axes[content[0]["time"]][1], channels)


def _array(path: Path, folder: Path, name: str) -> Floats:
    """Array that the other process left."""
    values = np.load(folder / Path(name).name, allow_pickle=False)
    check_sizes(path, "the recording", values.size, 1.0)
    return floats(values)


def _in_another_process(
    path: Path, wanted: Sequence[str] | None, folder: Path, seconds: float, size: int
) -> list[Mapping[str, Any]]:
    """Read a file in a process with limits; return name, unit, and files of values and times of each channel."""
    request = json.dumps(
        {
            "path": str(path.resolve()),
            "shown": str(path),
            "wanted": None if wanted is None else [*wanted],
            "folder": str(folder),
            "memory": MEMORY_LIMIT + 12 * size,
            "seconds": seconds,
        }
    )
    command = [sys.executable, "-m", __name__]
    root = str(Path(__file__).parents[3])
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))}
    try:
        finished = subprocess.run(
            command, input=request, capture_output=True, text=True, check=False, timeout=seconds, env=environment
        )
    except subprocess.TimeoutExpired:
        raise RecordingError(
            f"{path}: took more than {seconds:.0f} s to read, as damaged MDF files do; export it again"
        ) from None
    try:
        answer = json.loads(finished.stdout.splitlines()[-1])
    except (ValueError, IndexError):
        reason = (finished.stderr.strip().splitlines() or [f"code {finished.returncode}"])[-1][:200]
        raise RecordingError(f"{path}: is a damaged MDF file ({reason}); export it again") from None
    if "error" in answer:
        raise RecordingError(str(answer["error"]))
    found: list[Mapping[str, Any]] = answer["channels"]
    return found


# In the other process


def main() -> None:
    """Read the file of a request on standard input, and answer on standard output."""
    request = json.load(sys.stdin)
    path = Path(request["shown"])
    _limit(request["memory"], request["seconds"])
    try:
        answer: dict[str, Any] = {"channels": [*_channels(request)]}
    except RecordingError as error:
        answer = {"error": str(error)}
    except MemoryError:
        answer = {"error": f"{path}: does not fit into memory; split the file, or export the channels alone"}
    except Exception as error:  # asammdf raises what it likes about a damaged file
        answer = {
            "error": f"{path}: is a damaged MDF file ({type(error).__name__}: {str(error)[:200]}); export it again"
        }
    sys.stdout.write("\n" + json.dumps(answer) + "\n")


def _limit(memory: int, seconds: float) -> None:
    """Limit memory and processor time of this process, where the system can."""
    try:
        import resource
    except ImportError:
        return
    for kind, value in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, math.ceil(4.0 * seconds))):
        _, most = resource.getrlimit(kind)
        with suppress(ValueError, OSError):  # macOS refuses some limits of memory
            resource.setrlimit(kind, (value if most == resource.RLIM_INFINITY else min(value, most), most))


def _channels(request: Mapping[str, Any]) -> Iterator[dict[str, str]]:
    """Write the wanted channels and their times as arrays; yield their names, units and files."""
    from asammdf import MDF

    path, folder = Path(request["shown"]), Path(request["folder"])
    with MDF(request["path"]) as file:
        places = [
            (channel.name, group, index)
            for group, own in enumerate(file.groups)
            for index, channel in enumerate(own.channels)
            if index != file.masters_db.get(group) and own.channel_group.cycles_nr >= FEWEST_SAMPLES
        ]
        if not places or len(places) > _MOST_CHANNELS:
            raise RecordingError(f"{path}: has {len(places)} channels over time; export 1 to {_MOST_CHANNELS}")
        counts = [file.groups[group].channel_group.cycles_nr for _, group, _ in places]
        plain = [name for name, _, _ in places]
        names = [name if plain.count(name) == 1 else f"{group}/{name}" for name, group, _ in places]
        if request["wanted"] is None:
            chosen = [place for place, count in enumerate(counts) if count == max(counts)]
        else:
            chosen = [*places_of(path, names, request["wanted"])]
        for place in chosen:
            _, group, index = places[place]
            check_sizes(path, f"channel {names[place]}", counts[place], 1.0)
            conversion = file.groups[group].channels[index].conversion
            if getattr(conversion, "formula", "") or getattr(conversion, "conversion_type", None) == _ALGEBRAIC:
                raise RecordingError(
                    f"{path}: channel {names[place]} has a formula, which is not evaluated; export its values"
                )
            signal = file.get(group=group, index=index)
            if signal.samples.dtype.kind not in "iufb" or signal.samples.ndim != 1:
                if request["wanted"] is None:
                    continue
                raise RecordingError(f"{path}: channel {names[place]} holds no numbers; name another channel")
            for kind, values in (("c", signal.samples), ("t", signal.timestamps)):
                np.save(folder / f"{kind}{place}.npy", np.asarray(values, dtype=np.float64), allow_pickle=False)
            yield {"name": names[place], "unit": signal.unit, "values": f"c{place}.npy", "time": f"t{place}.npy"}


if __name__ == "__main__":
    main()
