"""The API pages, made from the package tree: one for each room of a library, one for each program.

A room is a package of a library: its page documents every public module whole. A program is a
service or a command, which nobody imports: its page documents its settings and lists its files.
The tree is read, not imported; the pages are reStructuredText with the directives of autodoc.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

from plain_docstrings import as_restructured_text

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "api"
"""Where the pages are written; ignored by git."""
FACADE = ROOT / "shared/hmcs"
OUTSIDE_ROOMS = "hmcs-outside-rooms"
"""Page of the modules of `hmcs` that lie in no room."""


def rooms() -> list[Path]:
    """Return the package folders of the libraries, one library after the other."""
    libraries = (FACADE, *ROOT.glob("shared/*/hmcs_*"))
    inits = (init for library in libraries for init in sorted(library.rglob("__init__.py")))
    return [init.parent for init in inits if "tests" not in init.parts]


def programs() -> list[Path]:
    """Return the package folders of the services and commands."""
    inits = (*ROOT.glob("services/*/hmcs_*/__init__.py"), *ROOT.glob("deploy/*/hmcs_*/__init__.py"))
    return sorted(init.parent for init in inits)


def pages() -> dict[str, str]:
    """Return the text of every API page by its name, in the order of the navigation."""
    made = {name_of(FACADE): _facade_page()}
    made |= {name_of(room): _room_page(room) for room in rooms() if room != FACADE}
    made[OUTSIDE_ROOMS] = _outside_rooms_page()
    return made | {name_of(program): _program_page(program) for program in programs()}


def write_pages(folder: Path = FOLDER) -> None:
    """Write the pages to `folder`, and delete what an earlier run left there."""
    folder.mkdir(parents=True, exist_ok=True)
    made = {folder / f"{name}.rst": text for name, text in pages().items()}
    for old in set(folder.iterdir()) - set(made):
        old.unlink()
    for path, text in made.items():
        # An unchanged page keeps its time: Sphinx then need not read it again.
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def name_of(path: Path) -> str:
    """Return the dotted name of a package folder or a module file."""
    names = [path.stem]
    while (path.parent / "__init__.py").is_file():
        path = path.parent
        names.insert(0, path.name)
    return ".".join(names)


def _facade_page() -> str:
    name = name_of(FACADE)
    return _page(f"``{name}``: the promised names", _automodule(name, members=True))


def _room_page(room: Path) -> str:
    name = name_of(room)
    modules = _modules(room)
    return _page(
        f"``{name}``",
        _automodule(name),
        _file_list(room, modules),
        *(_module_section(room, module) for module in modules),
    )


def _outside_rooms_page() -> str:
    modules = _modules(FACADE)
    return _page(
        f"``{name_of(FACADE)}``: files outside the rooms",
        ["What several rooms or services use. Nothing here is promised.", ""],
        _file_list(FACADE, modules),
        *(_module_section(FACADE, module) for module in modules),
    )


def _program_page(program: Path) -> str:
    name = name_of(program)
    files = [path for path in program.rglob("*.py") if path.name != "__init__.py"]
    return _page(
        f"``{name}``",
        _automodule(name),
        _file_list(program, sorted(files)),
        *(_module_section(program, path) for path in sorted(program.rglob("settings.py"))),
    )


def _modules(package: Path) -> list[Path]:
    """Return the public modules that lie directly in a package."""
    return sorted(path for path in package.glob("*.py") if not path.name.startswith("_"))


def _page(title: str, *parts: Iterable[str]) -> str:
    lines = [title, "=" * len(title), "", *(line for part in parts for line in part)]
    return "\n".join(lines)


def _module_section(package: Path, module: Path) -> Iterator[str]:
    title = f"``{module.relative_to(package)}``"
    yield from (title, "-" * len(title), "")
    yield from _automodule(name_of(module), members=True, reexports=False)


def _automodule(name: str, *, members: bool = False, reexports: bool = True) -> Iterator[str]:
    yield f".. automodule:: {name}"
    if members:
        yield "   :members:"
    if not reexports:
        yield "   :ignore-module-all:"
    yield ""


def _file_list(package: Path, modules: list[Path]) -> Iterator[str]:
    """Yield a table of files, each with the first sentence of its docstring."""
    yield from (".. list-table::", "   :widths: auto", "")
    for module in modules:
        tree = ast.parse(module.read_bytes(), str(module))
        summary = (ast.get_docstring(tree) or "").partition("\n")[0]
        (line,) = as_restructured_text([summary])
        yield f"   * - ``{module.relative_to(package)}``"
        yield f"     - {line}"
    yield ""
