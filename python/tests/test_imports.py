"""No crate has a circle of imports: files of which each uses an item of the next, and the last one of the first.

Read are `use` lines and paths such as `crate::a::b`, without tests. A name counts for the file that defines it, though
it is re-exported; a re-export alone is no use. Methods are not seen, nor are names that come out of macros and `*`.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from conftest import ROOT

CRATES = sorted(folder.parent for folder in (ROOT / "crates").glob("*/src"))
# Circles that stay: the trait of a friction has a method that gives its bristles, and their curve is such a friction.
KNOWN = {"clutch-core": [["friction/bristles.rs", "friction/mod.rs"]]}

# Comments, strings and characters.
NO_CODE = re.compile(r"""//[^\n]*|/\*.*?\*/|\br(#*)".*?"\1|"(?:\\.|[^"\\])*"|'(?:\\[^']+|[^\\'])'""", re.DOTALL)
FOR_TESTS = "#[cfg(test)]"
MODULE = re.compile(r"\bmod\s+(\w+)\s*([;{])")
USE = re.compile(r"(\bpub(?:\([^)]*\))?\s+)?\buse\s+([^;<]+);")
PATH = re.compile(r"(?<![\w:])(?:\w+::)+\w+")
# A name by itself, and no variant with a value.
NAME = re.compile(r"(?<![\w:])\w+\b(?!\s*=)")
DEFINITION = re.compile(r"\b(?:fn|struct|enum|trait|type|const|static|union|macro_rules!)\s+(\w+)")


@dataclass
class Module:
    """Its names are those of `use` lines, each for a path from the crate's root, or None for another crate's."""

    file: Path
    path: list
    children: dict = field(default_factory=dict)
    text: str = ""
    names: dict = field(default_factory=dict)
    reexported: set = field(default_factory=set)


def end_of_item(text, start):
    """The place behind a block, or behind a semicolon outside of brackets."""
    depth = 0
    for place in range(start, len(text)):
        depth += (text[place] in "([{") - (text[place] in ")]}")
        if depth == 0 and text[place] in ";}":
            return place + 1
    return len(text)


def module_of(file, folder, path, text=None):
    """The module that a file is, or a block in it with this text, and all below."""
    module, block = Module(file, path), text is not None
    text = text if block else NO_CODE.sub(" ", file.read_text("utf-8"))
    named = {name for name, _ in MODULE.findall(text)} | {"lib", "main", "mod"}
    while (start := text.find(FOR_TESTS)) >= 0:
        text = text[:start] + text[end_of_item(text, start + len(FOR_TESTS)) :]
    # Files that no line names are named by a macro.
    files = [] if block else [(place.stem, place) for place in folder.glob("*.rs") if place.stem not in named]
    while found := MODULE.search(text):
        name, end = found[1], found.end()
        if found[2] == "{":
            end = end_of_item(text, end - 1)
            inner = text[found.end() : end - 1]
            module.children[name] = module_of(file, folder / name, [*path, name], inner)
        else:
            files += [(name, place) for place in (folder / f"{name}.rs", folder / name / "mod.rs") if place.exists()]
        text = text[: found.start()] + text[end:]
    for name, place in files:
        module.children[name] = module_of(place, folder / name, [*path, name])
    module.text = text
    return module


def modules(module):
    yield module
    for child in module.children.values():
        yield from modules(child)


def leaves(tree):
    """Names in a `use`: of `a::{b, c as d}` a::b, called b, and a::c, called d."""
    head, brace, rest = tree.partition("{")
    if not brace:
        path, _, alias = tree.partition(" as ")
        parts = path.strip().removesuffix("::self").split("::")
        yield parts, alias.strip() or parts[-1]
        return
    depth, part = 0, ""
    for sign in rest[: rest.rindex("}")] + ",":
        depth += (sign == "{") - (sign == "}")
        if sign != "," or depth > 0:
            part += sign
        elif part.strip():
            yield from leaves(head.strip() + part.strip())
            part = ""


def from_root(module, parts):
    """A path from the crate's root; None if it leads to another crate."""
    first, *rest = parts
    if first == "crate":
        return rest
    if first in ("self", "super"):
        up = parts.count("super")
        return module.path[: len(module.path) - up] + [part for part in rest if part != "super"]
    if first in module.children:
        return module.path + parts
    known = module.names.get(first)
    return known and known + rest


def owner(root, path):
    """The file that defines an item; None for a module, for what another crate defines, and for what is not seen."""
    module = root
    for place, name in enumerate(path):
        last = place + 1 == len(path)
        if name in module.names and (last or name not in module.children):
            known = module.names[name]
            return known and owner(root, known + path[place + 1 :])
        if name not in module.children:
            return module.file if name in DEFINITION.findall(module.text) else None
        module = module.children[name]
    return None


def uses(top):
    """Each file of a crate, with the files whose items it uses."""
    root = module_of(top, top.parent, [])
    for module in modules(root):
        lines, module.text = USE.findall(module.text), USE.sub(" ", module.text)
        for public, tree in lines:
            for parts, name in leaves(" ".join(tree.split())):
                module.names[name] = from_root(module, parts)
                if public:
                    module.reexported.add(name)
    graph = {}
    for module in modules(root):
        used = (module.names.keys() - module.reexported) | set(NAME.findall(module.text))
        paths = [module.names.get(name) for name in used]
        paths += [from_root(module, path.split("::")) for path in PATH.findall(module.text)]
        files = graph.setdefault(module.file, set())
        files |= {owner(root, path) for path in paths if path} - {module.file, None}
    return graph


def circles(crate):
    """The circles of a crate, each as its files."""
    top = crate / "src" / "lib.rs"
    graph = uses(top if top.exists() else crate / "src" / "main.rs")
    reached = {}
    for file in graph:
        reached[file], left = set(), [file]
        while left:
            left += (new := graph[left.pop()] - reached[file])
            reached[file] |= new
    both = ({other for other in reached[file] if file in reached[other]} for file in graph)
    names = {frozenset(str(file.relative_to(crate / "src")) for file in circle) for circle in both if circle}
    return sorted(sorted(circle) for circle in names)


@pytest.mark.parametrize("crate", CRATES, ids=lambda crate: crate.name)
def test_no_files_of_a_crate_import_one_another_in_a_circle(crate):
    found = [circle for circle in circles(crate) if circle not in KNOWN.get(crate.name, [])]
    assert not found, f"{crate.name}: {found}"


def test_a_circle_is_found_over_other_files_and_re_exports_and_none_where_a_test_closes_it(tmp_path):
    files = {
        "lib.rs": "mod a;\nmod b;\nmod c;\nmod d;\nmod e;\npub use c::{Far, deep::Deep as Shown};\n",
        "a.rs": "use crate::b::B;\npub struct A(B);\n",
        "b.rs": "pub struct B;\nfn f() -> usize { crate::Shown::size() }\n",
        "c/mod.rs": "pub mod deep;\npub struct Far;\n",
        "c/deep.rs": "// use crate::d::D;\npub struct Deep;\nmod inner { use super::super::super::a::A; }\n",
        "d.rs": "use crate::e::E;\npub struct D;\n",
        "e.rs": "pub struct E;\n#[cfg(test)]\nmod tests { use crate::d::D; }\n",
    }
    for name, text in files.items():
        (tmp_path / "src" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "src" / name).write_text(text, "utf-8")
    assert circles(tmp_path) == [["a.rs", "b.rs", "c/deep.rs"]]
