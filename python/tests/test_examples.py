"""Every public name has an example in its documentation, and every example runs."""

import doctest
import importlib.util
import inspect
import os

import pytest

import clutch

# Modules that bring a library along, and that library.
MODULES = {"dynamics": "control", "executors": "ray", "gym": "gymnasium", "plot": "matplotlib"}


def public():
    """Names of the package and of its modules, with what they stand for."""
    for name in clutch.__all__:
        if name == "__version__":
            continue
        if name not in MODULES:
            yield f"clutch.{name}", getattr(clutch, name)
        elif importlib.util.find_spec(MODULES[name]) or "CI" in os.environ:
            module = getattr(clutch, name)
            for inner in module.__all__:
                yield f"clutch.{name}.{inner}", getattr(module, inner)


def documented(thing):
    """A class's own docstring and those of its members; a function's."""
    yield "", inspect.getdoc(thing) or ""
    if inspect.isclass(thing):
        for name, member in vars(thing).items():
            if not name.startswith("_"):
                yield f".{name}", inspect.getdoc(member) or ""


NAMES = {name: thing for name, thing in public() if callable(thing)}


@pytest.mark.parametrize("name", NAMES)
def test_the_examples_of_a_public_name_run(name, tmp_path, monkeypatch):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    monkeypatch.chdir(tmp_path)
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE | doctest.IGNORE_EXCEPTION_DETAIL
    runner, said = doctest.DocTestRunner(optionflags=flags), []
    for member, text in documented(NAMES[name]):
        test = doctest.DocTestParser().get_doctest(text, {}, name + member, None, 0)
        if test.examples:
            runner.run(test, out=said.append)
    pyplot.close("all")
    result = runner.summarize(verbose=False)
    assert result.attempted, f"{name} has no example"
    assert not result.failed, "".join(said)
