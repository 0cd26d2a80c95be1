"""The house rules that a reader of the code relies on, read from the source itself."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterable
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from tests.sources import ROOMS, ROOT, calls, imports, nodes, sources, strings, tree

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
    "partial_folder",
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
MEETING_PLACES = ("pipeline", "run_recording", "tracking", "link", "warm_up")
"""Figure 4 above tracking; tracking, which knows nothing of what is above; what lies between;
and what compiles all stages above tracking."""
RECORDING_WRITERS = ("airground/io/layout.py", "airground/io/recording_writer.py")
"""Know the name of the truth's folder, since `sim` writes recordings through them."""
MAX_LINES = 350


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


def test_no_modules_import_each_other() -> None:
    assert cycle(module_imports()) is None


def test_no_files_and_folders_side_by_side_import_each_other() -> None:
    """In every package, what lies directly in it can be put into one order."""
    beside: dict[str, list[tuple[str, str]]] = defaultdict(list)
    for importer, imported in module_imports():
        one, other = importer.split("."), imported.split(".")
        shared = 0
        while shared < min(len(one), len(other)) and one[shared] == other[shared]:
            shared += 1
        if 0 < shared < min(len(one), len(other)):
            beside[".".join(one[:shared])].append((one[shared], other[shared]))
    cycles = {package: cycle(pairs) for package, pairs in beside.items()}
    assert {package: found for package, found in cycles.items() if found} == {}


def module_imports() -> list[tuple[str, str]]:
    """(importing module, imported module) for all modules of the project."""
    files = {
        file.removesuffix(".py").replace("/", ".").removesuffix(".__init__"): file
        for file in sources(*ROOMS)
    }
    pairs = []
    for module, file in files.items():
        for name in imports(file):
            while name and name not in files:
                name = name.rpartition(".")[0]
            if name and name != module:
                pairs.append((module, name))
    return pairs


def cycle(pairs: Iterable[tuple[str, str]]) -> list[str] | None:
    """A cycle of imports, or None."""
    graph: dict[str, set[str]] = defaultdict(set)
    for importer, imported in pairs:
        graph[importer].add(imported)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return None


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
    known = {*STAGES, *SHARED, *MEETING_PLACES, "io", "__init__", "__main__"}
    parts = {Path(file).parts[1].removesuffix(".py") for file in sources("airground")}
    assert parts - known == set()
    assert parts.issuperset(MEETING_PLACES)


def test_tracking_knows_nothing_of_mapping() -> None:
    """So that a tracker can live on another computer than the mapper, and never waits for it."""
    mapping = ("pipeline", "dense", "ground_map", "refinement", "augmentation")
    forbidden = [f"airground.{name}" for name in mapping]
    assert importing(["airground/tracking.py", *sources("airground/link")], *forbidden) == []


def test_airground_never_names_the_truth() -> None:
    """No path, key or variable of `airground` leads to what only the evaluator may know."""
    wrong = []
    for file in sorted(set(sources("airground")) - set(RECORDING_WRITERS)):
        wrong += [f"{file}:{n}: {text!r}" for n, text in strings(file) if "truth" in text.lower()]
        for node in nodes(file):
            name = getattr(node, "id", None) or getattr(node, "attr", None)
            name = name or getattr(node, "arg", None) or getattr(node, "name", None)
            if isinstance(name, str) and ("truth" in name.lower() or "world" in name.lower()):
                wrong.append(f"{file}:{getattr(node, 'lineno', 0)}: {name}")
    assert wrong == []


def test_only_io_reads_files() -> None:
    """The pipeline is handed messages; it opens no recording and so no truth beside it."""
    elsewhere = [file for file in sources("airground") if "/io/" not in file]
    # The package itself only hands on names.
    stages = [file for file in elsewhere if file != "airground/__init__.py"]
    assert importing(stages, "airground.io") == []
    reading = [
        f"{file}:{line}: {call}"
        for file in elsewhere
        for line, call in calls(file)
        if call in ("open", "np.load", "cv2.imread") or call.endswith((".read_text", ".read_bytes"))
    ]
    assert reading == []


def test_nothing_executes_what_it_reads() -> None:
    """No pickle, eval, exec or shell: a recording from a stranger is only data."""
    assert importing(sources(*ROOMS), "pickle", "marshal", "shelve", "dill", "joblib") == []
    forbidden = {"eval", "exec", "compile", "os.system", "yaml.load", "__import__"}
    wrong = [f"{f}:{n}: {c}" for f in sources(*ROOMS) for n, c in calls(f) if c in forbidden]
    assert wrong == []
    allowing = [
        f"{file}:{node.value.lineno}: {node.arg}"
        for file in sources(*ROOMS)
        for node in nodes(file)
        if isinstance(node, ast.keyword)
        and node.arg in ("allow_pickle", "shell")
        and ast.unparse(node.value) != "False"
    ]
    assert allowing == []


def test_libraries_do_not_print_or_exit() -> None:
    """Only the command line speaks to the screen, and `python -m airground` is that; libraries log
    or raise."""
    wrong = [
        f"{file}:{line}: {call}"
        for file in sources("airground", "sim")
        for line, call in calls(file)
        if file != "airground/__main__.py"
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
    # `airground.run` is the top of a user's program: it takes the seed.
    assert [place.partition(":")[0] for place in seeded_inside] == ["airground/run_recording.py"]


def test_files_stay_readable() -> None:
    lines = {
        file: (ROOT / file).read_text("utf-8").count("\n") for file in sources(*ROOMS, "tests")
    }
    assert {file: count for file, count in lines.items() if count > MAX_LINES} == {}


def test_modules_and_public_names_are_documented() -> None:
    silent = [file for file in sources(*ROOMS) if ast.get_docstring(tree(file)) is None]
    assert silent == []
    bare = [
        f"{file}:{node.lineno}: {node.name}"
        for file in sources(*ROOMS)
        for node in tree(file).body
        if isinstance(node, ast.ClassDef | ast.FunctionDef)
        and ast.get_docstring(node) is None
        # A private name, a small class or a short function may say it all by itself.
        and not (node.name.startswith("_") or len(node.body) <= 10)
    ]
    assert bare == []
