"""The house rules that a reader of the code relies on, read from the source itself."""

from __future__ import annotations

import ast
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("airground", "sim", "evaluation")
EVALUATION_LAYERS = (
    "setup",
    "table",
    "run",
    "measure",
    "judge",
    "show",
    "bench",
    "datasets",
    "commands",
    "cli",
)
"""Each imports only those before it, and itself."""
SIM_ROOMS = (
    "interrupts",
    "scene",
    "geometry",
    "appearance",
    "world",
    "robots",
    "sensors",
    "recording",
)
"""Likewise."""
STAGES = ("slam", "dense", "localization", "refinement", "augmentation", "ground_map")
"""Modules and packages of `airground` that only those below may bring together."""
SHARED = ("core", "config", "errors")
"""What a stage may import from `airground`."""
MEETING_PLACES = ("pipeline", "tracking", "link", "warm_up")
"""Figure 4 above tracking; tracking, which knows nothing of what is above; what lies between;
and what compiles all stages above tracking."""
RECORDING_WRITERS = ("airground/io/layout.py", "airground/io/recording_writer.py")
"""Know the name of the truth's folder, since `sim` writes recordings through them."""
PEERS = ("evaluation/bench/peers.py",)
"""Times other libraries, of which some need not be installed."""
MAX_LINES = 350

DISTRIBUTION_OF = {
    "rerun_cli": "rerun-sdk",
    "OpenGL": "pyopengl",
    "PIL": "pillow",
    "cv2": "opencv-python-headless",
    "kiss_matcher": "kiss-matcher",
    "rerun": "rerun-sdk",
    "skimage": "scikit-image",
    "small_gicp": "small-gicp",
    "tomli_w": "tomli-w",
    "yaml": "pyyaml",
    "zmq": "pyzmq",
}
"""Imports whose package is called otherwise."""


def sources(*folders: str) -> list[str]:
    """Every Python file below the folders, relative to the repository."""
    files = [file for folder in folders for file in (ROOT / folder).rglob("*.py")]
    return sorted(str(file.relative_to(ROOT)) for file in files)


@cache
def tree(file: str) -> ast.Module:
    return ast.parse((ROOT / file).read_text(encoding="utf-8"), filename=file)


def imports(file: str) -> Iterator[str]:
    """Dotted names of all that a file imports, wherever in the file it does."""
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}:{node.lineno}: relative import"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def importing(files: list[str], *forbidden: str) -> list[str]:
    """ "file imports name", for every import of a forbidden module or of one inside it."""
    return [
        f"{file} imports {name}"
        for file in files
        for name in imports(file)
        if any(f"{name}.".startswith(f"{module}.") for module in forbidden)
    ]


def test_airground_knows_neither_simulator_nor_evaluator_nor_viewer() -> None:
    forbidden = ("sim", "evaluation", "mujoco", "rerun", "matplotlib", "pyrender", "tests")
    assert importing(sources("airground"), *forbidden) == []


def test_sim_imports_only_core_io_and_errors() -> None:
    allowed = ("airground.core.", "airground.io.", "airground.errors.")
    wrong = [
        f"{file} imports {name}"
        for file in sources("sim")
        for name in imports(file)
        if f"{name}.".startswith("airground.") and not f"{name}.".startswith(allowed)
    ]
    assert wrong == []
    assert importing(sources("sim"), "evaluation", "tests") == []


def test_layers_of_the_evaluator_import_only_those_below() -> None:
    assert climbing("evaluation", EVALUATION_LAYERS) == []


def test_rooms_of_the_simulator_import_only_those_below() -> None:
    assert climbing("sim", SIM_ROOMS) == []


def climbing(package: str, layers: tuple[str, ...]) -> list[str]:
    """ "file imports name", for every import of a layer that is not below the file's own."""
    wrong = []
    for file in sources(package):
        layer = Path(file).parts[1].removesuffix(".py")
        if layer == "__init__":
            continue
        assert layer in layers, f"{file}: {layer} has no place among the layers of {package}"
        below = layers[: layers.index(layer) + 1]
        wrong += [
            f"{file} imports {name}"
            for name in imports(file)
            if name.startswith(f"{package}.") and name.split(".")[1] not in below
        ]
    return wrong


def test_stages_do_not_import_each_other() -> None:
    wrong = []
    for file in sources("airground"):
        stage = Path(file).parts[1].removesuffix(".py")
        if stage in STAGES:
            allowed = tuple(f"airground.{name}." for name in (*SHARED, stage))
            wrong += [
                f"{file} imports {name}"
                for name in imports(file)
                if name.startswith("airground.") and not f"{name}.".startswith(allowed)
            ]
    assert wrong == []


def test_core_imports_nothing_else_of_ours() -> None:
    wrong = [
        f"{file} imports {name}"
        for file in sources("airground/core")
        for name in imports(file)
        if name.startswith("airground.")
        and not f"{name}.".startswith(("airground.core.", "airground.errors."))
    ]
    assert wrong == []


def test_every_part_of_airground_has_a_known_place() -> None:
    """A new stage must be named above, or the rules would pass it by."""
    known = {*STAGES, *SHARED, *MEETING_PLACES, "io", "__init__"}
    parts = {Path(file).parts[1].removesuffix(".py") for file in sources("airground")}
    assert parts - known == set()
    assert parts.issuperset(MEETING_PLACES)


def test_tracking_knows_nothing_of_mapping() -> None:
    """So that a tracker can live on another computer than the mapper, and never waits for it."""
    mapping = ("pipeline", "dense", "ground_map", "refinement", "augmentation")
    forbidden = [f"airground.{name}" for name in mapping]
    assert importing(["airground/tracking.py", *sources("airground/link")], *forbidden) == []


def strings(file: str) -> Iterator[tuple[int, str]]:
    """Text in the code, docstrings apart."""
    docstrings = set()
    for node in ast.walk(tree(file)):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            docstrings |= {
                id(child.value)
                for child in body
                if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant)
            }
    for node in ast.walk(tree(file)):
        if not isinstance(node, ast.Constant) or id(node) in docstrings:
            continue
        if isinstance(node.value, str):
            yield node.lineno, node.value


def test_airground_never_names_the_truth() -> None:
    """No path, key or variable of `airground` leads to what only the evaluator may know."""
    wrong = []
    for file in sorted(set(sources("airground")) - set(RECORDING_WRITERS)):
        wrong += [f"{file}:{n}: {text!r}" for n, text in strings(file) if "truth" in text.lower()]
        for node in ast.walk(tree(file)):
            name = getattr(node, "id", None) or getattr(node, "attr", None)
            name = name or getattr(node, "arg", None) or getattr(node, "name", None)
            if isinstance(name, str) and ("truth" in name.lower() or "world" in name.lower()):
                wrong.append(f"{file}:{getattr(node, 'lineno', 0)}: {name}")
    assert wrong == []


def test_only_io_reads_files() -> None:
    """The pipeline is handed messages; it opens no recording and so no truth beside it."""
    elsewhere = [file for file in sources("airground") if "/io/" not in file]
    assert importing(elsewhere, "airground.io") == []
    reading = [
        f"{file}:{line}: {call}"
        for file in elsewhere
        for line, call in calls(file)
        if call in ("open", "np.load", "cv2.imread") or call.endswith((".read_text", ".read_bytes"))
    ]
    assert reading == []


def calls(file: str) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.Call):
            yield node.lineno, ast.unparse(node.func)


def test_nothing_executes_what_it_reads() -> None:
    """No pickle, eval, exec or shell: a recording from a stranger is only data."""
    assert importing(sources(*ROOMS), "pickle", "marshal", "shelve", "dill", "joblib") == []
    forbidden = {"eval", "exec", "compile", "os.system", "yaml.load", "__import__"}
    wrong = [f"{f}:{n}: {c}" for f in sources(*ROOMS) for n, c in calls(f) if c in forbidden]
    assert wrong == []
    for file in sources(*ROOMS):
        for node in ast.walk(tree(file)):
            if isinstance(node, ast.keyword) and node.arg in ("allow_pickle", "shell"):
                assert ast.unparse(node.value) == "False", f"{file}:{node.value.lineno}"


def test_libraries_do_not_print_or_exit() -> None:
    """Only the command line speaks to the screen; libraries log or raise."""
    wrong = [
        f"{file}:{line}: {call}"
        for file in sources("airground", "sim")
        for line, call in calls(file)
        if call in ("print", "exit", "quit", "sys.exit", "os._exit")
    ]
    assert wrong == []


def test_randomness_comes_from_a_generator_passed_in() -> None:
    allowed = ("default_rng", "Generator", "SeedSequence", "PCG64")
    seeded = ("np.random.default_rng(", "np.random.SeedSequence(")
    wrong = [
        f"{file}:{line}: {call}"
        for file in sources(*ROOMS)
        for line, call in calls(file)
        if call.startswith(("np.random.", "random."))
        and not call.endswith(allowed)
        and not call.startswith(seeded)
    ]
    assert wrong == []
    seeded_inside = [
        f"{file}:{line}"
        for file in sources("airground")
        for line, call in calls(file)
        if call.endswith("default_rng")
    ]
    assert seeded_inside == []


@pytest.mark.parametrize("file", sources(*ROOMS, "tests"))
def test_files_stay_readable(file: str) -> None:
    lines = (ROOT / file).read_text(encoding="utf-8").splitlines()
    assert len(lines) <= MAX_LINES, f"{file} has {len(lines)} lines"


@pytest.mark.parametrize("file", sources(*ROOMS))
def test_modules_and_public_names_are_documented(file: str) -> None:
    assert ast.get_docstring(tree(file)) is not None, f"{file} does not say what it is for"
    bare = [
        f"{file}:{node.lineno}: {node.name}"
        for node in tree(file).body
        if isinstance(node, ast.ClassDef | ast.FunctionDef)
        and ast.get_docstring(node) is None
        # A private name, a small class or a short function may say it all by itself.
        and not (node.name.startswith("_") or len(node.body) <= 10)
    ]
    assert bare == []


def test_every_import_is_a_declared_dependency() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = {_distribution(line) for line in project["dependencies"]}
    extras = project["optional-dependencies"]
    for_tests = declared | {_distribution(line) for line in extras["dev"]}
    for_baselines = declared | {_distribution(line) for line in extras["baselines"]}
    baselines = {*sources("evaluation/measure/baselines"), *PEERS}
    assert _undeclared(sorted(set(sources(*ROOMS)) - baselines), declared) == []
    assert _undeclared(sorted(baselines), for_baselines) == []
    assert _undeclared(sources("tests"), for_tests) == []


def _undeclared(files: list[str], declared: set[str]) -> list[str]:
    ours = {*ROOMS, "tests", "scenes", "__future__"}
    wrong = []
    for file in files:
        for module in {name.partition(".")[0] for name in imports(file)}:
            if module in ours or module in sys.stdlib_module_names:
                continue
            if DISTRIBUTION_OF.get(module, module).lower() not in declared:
                wrong.append(f"{file} imports {module}")
    return sorted(wrong)


def _distribution(requirement: str) -> str:
    for character in "<>=!~;[ ":
        requirement = requirement.partition(character)[0]
    return requirement.lower()


def test_locked_packages_carry_names_versions_and_hashes_only() -> None:
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    lines = [line.strip().rstrip("\\").strip() for line in lock.splitlines()]
    for line in lines:
        kinds = ("#", "--hash=sha256:")
        assert not line or line.startswith(kinds) or "==" in line, line
        assert "://" not in line, line
        assert not line.startswith(("-i", "--index", "--extra-index", "--find-links")), line
    assert "pyopengl==3.1.10" in [line.partition(" ")[0] for line in lines]
