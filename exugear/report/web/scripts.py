"""Scripts of the pages: small modules, joined in the order of their imports into one that needs no address.

A page that lies in a file cannot import modules. So each module becomes a function that is called once and gives what
the module exports; an import becomes constants taken from what an earlier one gave. Nothing else is changed.
"""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files

_IMPORT = re.compile(r'^import (\{[^}]*\}) from "\./([a-z_]+)\.js";$', re.MULTILINE)
_EXPORT = re.compile(r"^export ((?:async )?(?:function|const|class) (\w+))", re.MULTILINE)


@cache
def script_source(name: str) -> str:
    """Text of a module."""
    return files("exugear.report.web").joinpath("scripts", f"{name}.js").read_text(encoding="utf-8")


def module_order(name: str) -> tuple[str, ...]:
    """Names of a module and all that it imports, each after those that it needs.

    Examples
    --------
    >>> module_order("theme")
    ('dom', 'theme')
    """
    order: dict[str, None] = {}

    def visit(one: str) -> None:
        if one in order:
            return
        for _, needed in _IMPORT.findall(script_source(one)):
            visit(needed)
        order[one] = None

    visit(name)
    return tuple(order)


def as_function(name: str, source: str) -> str:
    r"""Make a module a function that is called once.

    Examples
    --------
    >>> print(as_function("sum", 'import { one } from "./ones.js";\nexport const two = one + one;'))
    const $sum = (() => {
    const { one } = $ones;
    const two = one + one;
    return { two };
    })();
    """
    exported = ", ".join(found for _, found in _EXPORT.findall(source))
    body = _EXPORT.sub(r"\1", _IMPORT.sub(r"const \1 = $\2;", source))
    return f"const ${name} = (() => {{\n{body.rstrip()}\nreturn {{ {exported} }};\n}})();"


def bundle(name: str) -> str:
    """One script of a module and all that it imports."""
    parts = [as_function(one, script_source(one)) for one in module_order(name)]
    return '"use strict";\n(() => {\n' + "\n".join(parts) + "\n})();\n"
