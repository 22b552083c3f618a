"""Every command and code block of README.md, CONTRIBUTING.md and docs/ runs, and the generated pages are whole.

A line `<!-- not run: REASON -->` before a block says why it is skipped; `<!-- slow -->` defers it to `pytest --slow`.
The blocks of a page run in order, in one folder with the studies of configs/. Commands trace a small film.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import util
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import tomli_w
from click.testing import CliRunner

import lenscl
from lenscl.cli import main
from lenscl.config import study_schema
from lenscl.effects import EFFECTS, Output
from lenscl.lenses import catalogue, face_names
from lenscl.materials import CATALOGUE
from lenscl.methods import METHODS

ROOT = Path(__file__).parents[1]
FILES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
LANGUAGES = {"bash", "python", "toml", "text"}
SETUP = re.compile(r"python3 -m venv \.venv|\. \.venv/bin/activate|pip install -e '\.\[(?P<extras>[\w,]+)\]'")
SMALL = ("--set", "film.size=[24, 20]")
SIZED = {"render", "map", "sweep", "check"}  # commands that take SMALL; `explain` does without a pixel
FENCE = re.compile(
    r"^(?:<!-- (?P<mark>not run: [^\n]+|slow) -->\n)?^(?P<ticks>`{3,})(?P<language>[\w-]+)\n(?P<text>.*?)^(?P=ticks)$",
    re.MULTILINE | re.DOTALL,
)
# What a fragment of a study is completed with
BASE: Mapping[str, Any] = {
    "source": {"at": [0, 0, 4]},
    "film": {"centre": [0, 0, 2.5], "right": [0.8, 0, 0], "down": [0, -0.8, 0], "size": [6, 6]},
    "picture": {"centre": [0, 0, -2.5], "right": [6, 0, 0], "down": [0, -6, 0]},
    "lens": [{"surface": "torus", "r": 0.25, "n": 1.5}],
}


@dataclass(frozen=True)
class Block:
    """A code block, with the place where it stands."""

    file: Path
    line: int
    language: str
    text: str
    mark: str  # "", "slow", or "not run: REASON"

    @property
    def place(self) -> str:
        return f"{self.file.relative_to(ROOT)}:{self.line}"


def blocks_of(file: Path) -> list[Block]:
    text = file.read_text(encoding="utf-8")
    return [
        Block(file, text.count("\n", 0, found.start()) + 1, found["language"], found["text"], found["mark"] or "")
        for found in FENCE.finditer(text)
    ]


BLOCKS = {file.name: blocks_of(file) for file in FILES}
SLOW = [block for blocks in BLOCKS.values() for block in blocks if block.mark == "slow"]


@pytest.fixture
def clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder like a fresh clone's, with this interpreter's commands on PATH."""
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    return tmp_path


def commands_of(text: str) -> Iterator[str]:
    """Yield the commands of a block: a line each, or several joined by &&."""
    for line in text.splitlines():
        words = line.split(" #")[0].strip()
        if words and not words.startswith("#"):
            yield from (part.strip() for part in words.split("&&"))


def run_command(command: str) -> None:
    """Run a command of lenscl in this process; of a set-up, look up the extras that it names."""
    if (setup := SETUP.fullmatch(command)) is not None:
        extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
            "optional-dependencies"
        ]
        assert set((setup["extras"] or "").split(",")) <= {*extras, ""}, command
        return
    command, _, target = command.partition(" > ")
    program, name, *words = shlex.split(command)
    assert program == "lenscl", f"{command}: only commands of lenscl run here; mark the block as not run"
    if name in SIZED or (name == "explain" and "--pixel" not in words):
        words += SMALL
    result = CliRunner().invoke(main, [name, *words])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    expected = {0, 3} if "--compare" in words else {0}  # 3: this machine was slower just now
    assert result.exit_code in expected, f"{command}\n{result.output}"
    if target:
        Path(target).write_text(result.stdout, encoding="utf-8")


def run_study(text: str) -> None:
    """Complete a fragment of a study, read it with its points, and trace the lenses that it describes."""
    written = tomllib.loads(text)
    document = {key: value for key, value in BASE.items() if key not in written} | written
    document["film"] = document["film"] | {"size": BASE["film"]["size"]}
    path = Path("configs") / "fragment.toml"
    path.write_text(tomli_w.dumps(document), encoding="utf-8")
    study = lenscl.load_study(path)
    assert len(list(study.points())) >= 1
    if "lens" in written:
        assert (lenscl.trace(study.scene).events > 0).any()


def run_block(block: Block, names: dict[str, Any]) -> None:
    if block.language == "bash":
        for command in commands_of(block.text):
            run_command(command)
    elif block.language == "python":
        exec(compile(block.text, block.place, "exec"), names)
    elif block.language == "toml":
        run_study(block.text)


@pytest.mark.parametrize("name", [name for name, blocks in BLOCKS.items() if blocks])
def test_every_block_of_a_page_runs(name: str, clone: Path, capfd: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    for block in BLOCKS[name]:
        assert block.language in LANGUAGES, f"{block.place}: nobody knows how to run {block.language}"
        if not block.mark:
            try:
                run_block(block, names)
            except BaseException as error:
                error.add_note(f"in the block at {block.place}")
                raise


@pytest.mark.slow
@pytest.mark.parametrize("block", SLOW, ids=lambda block: block.place)
def test_every_slow_block_runs(block: Block, clone: Path) -> None:
    run_block(block, {})


def test_blocks_of_every_kind_are_found_and_few_are_skipped() -> None:
    every = [block for blocks in BLOCKS.values() for block in blocks]
    assert {block.language for block in every} == LANGUAGES
    assert sum(block.language == "bash" for block in every) > 20
    assert sum(block.language == "python" for block in every) > 8
    assert sum(block.language == "toml" for block in every) > 9
    assert sum(block.mark.startswith("not run") for block in every) < 6
    assert len(SLOW) < 8
    for file in FILES:  # none is missed for its indentation or its mark
        text = file.read_text(encoding="utf-8")
        fences = len(re.findall(r"^\s*`{3,}[a-z]", text, re.MULTILINE))
        assert fences == len(BLOCKS[file.name]), file.name


def test_a_block_that_is_wrong_fails(clone: Path) -> None:
    for text in ("lenscl render configs/absent.toml -o x.png", "rm -r configs", "pip install -e '.[absent]'"):
        with pytest.raises(AssertionError):
            run_command(text)
    with pytest.raises(lenscl.StudyError):
        run_study('[[lens]]\nsurface = "torsu"\nn = 1.5')
    with pytest.raises(ZeroDivisionError):
        run_block(Block(ROOT / "README.md", 1, "python", "1 / 0", ""), {})


def test_the_environment_is_used_the_same_way_in_every_block() -> None:
    for blocks in BLOCKS.values():
        for block in blocks:
            if block.language == "bash":
                assert ".venv/" not in block.text.replace(". .venv/bin/activate", ""), block.place


def test_links_and_pictures_lead_to_files() -> None:
    checked = 0
    for file in FILES:
        for target in re.findall(r"\]\(([^)\s]+)\)", file.read_text(encoding="utf-8")):
            if "://" not in target and not target.startswith("#"):
                assert (file.parent / target.split("#")[0]).is_file(), f"{file.name}: {target}"
                checked += 1
    assert checked > 40


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 150


def test_every_page_is_in_the_contents() -> None:
    listed = set(re.findall(r"^[a-z-]+$", (ROOT / "docs" / "index.md").read_text(encoding="utf-8"), re.MULTILINE))
    assert listed == {file.stem for file in (ROOT / "docs").glob("*.md")} - {"index"}


@pytest.fixture(scope="module")
def generate() -> ModuleType:
    spec = util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    module = util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_generated_pages_have_every_key_command_lens_and_material(generate: ModuleType, tmp_path: Path) -> None:
    generate.write_all(tmp_path)
    pages = {file.stem: file.read_text(encoding="utf-8") for file in tmp_path.glob("*.md")}
    expected = {
        "study-keys": [key for key, _ in keys_of(study_schema(), is_deep=False)],
        "effect-keys": list(study_schema()["properties"]["effects"]["properties"]),
        "effect-arrays": [output.name for output in outputs()],
        "commands": [f"lenscl {name}" for name in main.commands],
        "lenses": list(catalogue()),
        "materials": list(CATALOGUE),
    }
    assert set(pages) == set(expected)
    for page, names in expected.items():
        assert len(names) > 8
        for name in names:
            assert re.search(rf"(`|^### ){re.escape(name)}\b", pages[page], re.MULTILINE), f"{page}: {name}"
    for surface in catalogue().values():
        page = pages["lenses"].partition(f"### {surface.name}\n")[2].partition("\n### ")[0]
        faces = re.search(r"^Faces: (.+)\.$", page, re.MULTILINE)
        assert faces is not None, surface.name
        if not surface.given_as:
            assert re.findall(r"`([^`]+)`", faces[1]) == list(face_names(surface)), surface.name
    for name in catalogue():
        assert (ROOT / "docs" / "pictures" / "lenses" / f"{name}.jpg").is_file(), (
            f"docs/figures/draw.py gallery: {name}"
        )


def outputs() -> Iterator[Output]:
    """Yield the arrays that effects add."""
    for effect in EFFECTS.values():
        for variants in effect.variants.values():
            for variant in variants:
                yield from variant.adds


def keys_of(schema: Mapping[str, Any], *, is_deep: bool = True) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield every key that a schema describes, with its own schema; deep: also those of tables inside values."""
    for key, entry in schema.get("properties", {}).items():
        is_table = "properties" in entry or "properties" in entry.get("items", {})
        if (is_deep or not is_table) and "const" not in entry:  # a condition on a key that stands elsewhere
            yield key, entry
    inner = [*schema.get("properties", {}).values(), schema.get("items", {})]
    if is_deep:
        inner += [*schema.get("anyOf", ()), schema.get("additionalProperties", {})]
    for other in inner:
        if isinstance(other, Mapping) and other:
            yield from keys_of(other, is_deep=is_deep)


def test_every_key_of_the_schema_has_a_description() -> None:
    found = list(keys_of(study_schema()))
    assert len(found) > 70
    assert {"sellmeier", "nd", "linspace", "scale", "environment", "title", "lens", "axes"} <= {key for key, _ in found}
    for key, entry in found:
        assert len(entry.get("description", "").split()) > 1, key


def test_pages_name_every_method_effect_and_status() -> None:
    for page, names in {
        "accuracy": [*METHODS],
        "effects": [*EFFECTS],
        "glossary": [status.name for status in lenscl.RayStatus],
    }.items():
        text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
        for name in names:
            assert re.search(rf"`{name}\b", text), f"docs/{page}.md: says nothing of {name}"


def test_names_in_the_architecture_are_packages() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = [line.split("|") for line in text.splitlines() if re.match(r"\| (\d|any|apart) \|", line)]
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row[2])}
    rooms = {path.parent.name for path in (ROOT / "lenscl").glob("*/__init__.py")}
    assert rooms <= named
    assert named - rooms == {"errors", "status", "version"}
