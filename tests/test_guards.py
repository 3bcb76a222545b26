"""Cheap permanent guards: direction of imports, light imports, honest `__all__`, a README that runs."""

import ast
import importlib
import pkgutil
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import paxel_design
import paxel_runtime

ROOT = Path(__file__).resolve().parents[1]
MODULES = sorted(
    module.name
    for package in (paxel_runtime, paxel_design)
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
)
HEAVY = {"colour", "trimesh", "manifold3d", "reportlab", "matplotlib", "pyvista", "plotly", "pikepdf", "networkx"}


def _imports(path: Path) -> set[str]:
    """Dotted names that a file imports, anywhere in it."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


@pytest.mark.parametrize("name", MODULES)
def test_all_is_sorted_and_true(name: str) -> None:
    module = importlib.import_module(name)
    own = {n for n, v in vars(module).items() if not n.startswith("_") and getattr(v, "__module__", "") == name}
    exported = getattr(module, "__all__", None)
    assert exported is not None or not own, f"{name} has no __all__"
    assert len(set(exported or [])) == len(exported or [])
    assert all(hasattr(module, item) for item in exported or [])


def test_the_runtime_never_imports_the_design_side() -> None:
    for path in (ROOT / "paxel_runtime").rglob("*.py"):
        assert not any(name.split(".")[0] in ("paxel_design", "reports") for name in _imports(path)), path


def test_the_model_knows_no_files_and_no_devices() -> None:
    for path in (ROOT / "paxel_runtime" / "model").rglob("*.py"):
        ours = {name for name in _imports(path) if name.startswith("paxel_runtime.")}
        allowed = ("paxel_runtime.model", "paxel_runtime.errors", "paxel_runtime.numba_options")
        assert all(name.startswith(allowed) for name in ours), (path, ours)


def test_the_bench_shares_only_colorimetry_and_the_pattern_with_the_estimators() -> None:
    bench = [*(ROOT / "paxel_runtime" / "optics").glob("*.py"), *(ROOT / "paxel_runtime" / "devices").glob("*.py")]
    allowed = (
        "paxel_runtime.devices",
        "paxel_runtime.errors",
        "paxel_runtime.model.colorimetry",
        "paxel_runtime.model.fluorescence",  # what a colorant of the pattern is
        "paxel_runtime.model.pattern",
        "paxel_runtime.numba_options",  # how kernels are compiled
        "paxel_runtime.bands",  # bands of rows on threads
        "paxel_runtime.optics",
        "paxel_runtime.spectral_files",  # reads tables of numbers
    )
    assert len(bench) >= 4
    for path in bench:
        ours = {name for name in _imports(path) if name.startswith("paxel_runtime.")}
        assert all(name.startswith(allowed) for name in ours), (path, ours)


def test_only_the_stages_open_the_bench() -> None:
    bench = ("paxel_runtime.devices.virtual", "paxel_runtime.devices.bench", "paxel_runtime.optics")
    own = {ROOT / "paxel_runtime" / folder for folder in ("optics", "devices", "stages")}
    for path in [*(ROOT / "paxel_runtime").rglob("*.py"), *(ROOT / "paxel_design").rglob("*.py")]:
        if path.parent not in own:
            assert not any(name.startswith(bench) for name in _imports(path)), path


@pytest.mark.parametrize("package", ["paxel_runtime", "paxel_runtime.stages"])
def test_the_runtime_loads_no_heavy_library(package: str) -> None:
    program = f"import sys, {package}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    assert not HEAVY & set(loaded)


@pytest.mark.parametrize("package", [paxel_runtime, paxel_design])
def test_every_lazy_name_is_there(package: ModuleType) -> None:
    assert package.__all__ == sorted(package.__all__)
    assert all(getattr(package, name) is not None for name in package.__all__)
    with pytest.raises(AttributeError):
        _ = package.nothing


def test_the_readme_tells_what_there_is() -> None:
    from paxel_design.cli import app

    text = (ROOT / "README.md").read_text(encoding="utf-8")
    commands = {command.name or command.callback.__name__ for command in app.registered_commands if command.callback}
    assert commands - {"demo"} == set(re.findall(r"^\| `paxel (\w+)", text, flags=re.MULTILINE))
    for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", text):
        assert (ROOT / picture).is_file(), picture
    for block in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL):
        compile(block, "README.md", "exec")


def test_no_library_code_prints_or_swallows() -> None:
    for path in [*(ROOT / "paxel_runtime").rglob("*.py"), *(ROOT / "paxel_design").rglob("*.py")]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            assert not (isinstance(node, ast.ExceptHandler) and node.type is None), f"{path}: bare except"
            called = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
            assert called != "print", f"{path}: print"
