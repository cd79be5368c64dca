"""The README's example runs as printed."""

from __future__ import annotations

import re
from pathlib import Path

README = Path(__file__).parent.parent / "README.md"


def test_the_python_example_runs(capsys):
    (program,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    exec(compile(program, str(README), "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    found = {float(line.split()[2].rstrip(":")): float(line.split()[3]) for line in lines}
    assert list(found) == [0.2, 0.5, 1.0]
    assert found[0.2] < found[0.5] < found[1.0], "stiffer seats raise the frequency of a mode on bearings"
