"""Python names of the site, found by their last part: a search through all names for each type takes a minute."""

from __future__ import annotations

from typing import Any

from sphinx.application import Sphinx
from sphinx.domains.python import ObjectEntry, PythonDomain


class IndexedPythonDomain(PythonDomain):
    """Python names, with those that end alike side by side."""

    _ends: dict[str, list[str]]
    _indexed = 0

    def find_obj(
        self, env: Any, modname: str | None, classname: str | None, name: str, type: str | None, searchmode: int = 0
    ) -> list[tuple[str, ObjectEntry]]:
        """Find a name as it stands, or else in a search mode of 1, all objects whose full names end with it."""
        found = super().find_obj(env, modname, classname, name, type)
        if found or searchmode == 0 or not name:
            return found
        if self._indexed != len(self.objects):
            self._ends = {}
            for full in self.objects:
                self._ends.setdefault(full.rpartition(".")[2], []).append(full)
            self._indexed = len(self.objects)
        kinds = list(self.object_types) if type is None else self.objtypes_for_role(type) or []
        return [
            (full, self.objects[full])
            for full in self._ends.get(name.removesuffix("()").rpartition(".")[2], ())
            if full.endswith(f".{name.removesuffix('()')}") and self.objects[full].objtype in kinds
        ]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.add_domain(IndexedPythonDomain, override=True)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
