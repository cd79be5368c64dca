"""What the two packages offer: these names and no others, each where it says, at no cost before it is used."""

from __future__ import annotations

import importlib
import subprocess
import sys
from types import ModuleType

import pytest

PACKAGES = ("exugear", "fe_ste")
NAMES = [(package, name) for package in PACKAGES for name in importlib.import_module(package).__all__]


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_shows_its_public_names_alone(package):
    module = importlib.import_module(package)
    assert dir(module) == sorted(module.__all__)
    assert len(set(module.__all__)) == len(module.__all__)


@pytest.mark.parametrize(("package", "name"), NAMES)
def test_a_public_name_leads_to_what_carries_it(package, name):
    value = getattr(importlib.import_module(package), name)
    if isinstance(value, ModuleType):
        assert value.__name__.rpartition(".")[2] == name
    elif not isinstance(value, str):
        assert value.__name__ == name
        assert value.__module__.startswith(f"{package}.")


@pytest.mark.parametrize("package", PACKAGES)
def test_a_star_imports_the_public_names(package):
    namespace: dict[str, object] = {}
    exec(f"from {package} import *", namespace)
    assert set(namespace) - {"__builtins__"} == set(importlib.import_module(package).__all__)


@pytest.mark.parametrize("package", PACKAGES)
def test_another_name_is_refused_as_of_any_module(package):
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'Gearboxes'"):
        _ = importlib.import_module(package).Gearboxes


@pytest.mark.parametrize("package", PACKAGES)
def test_import_alone_loads_nothing_heavy(package):
    program = f"import sys, {package}\nsys.exit(', '.join({{'numpy', 'scipy', 'numba', 'xarray'}} & set(sys.modules)))"
    outcome = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert outcome.stderr.strip() == ""
