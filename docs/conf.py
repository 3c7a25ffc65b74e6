"""Configuration of the documentation.

Build it in the folder above, with wheel and playground, in target/site::

    cargo xtask site
"""

from pathlib import Path

from sphinx import addnodes

import clutch

project = "clutch"
author = "The clutch authors"
release = clutch.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "furo"
html_title = f"clutch {release}"
html_show_copyright = False

# The playground is a page of its own, which is copied as it is.
_playground = Path(__file__).parents[1] / "target" / "playground"
if _playground.exists():
    html_extra_path = [str(_playground)]
else:
    print("skipped: the playground, which `cargo xtask playground` builds; docs/playground.md links to it")

# Pages link to headings of each other as GitHub names them, down to the third level.
myst_heading_anchors = 3

napoleon_google_docstring = False
autodoc_member_order = "bysource"
# Defaults as they are written, "clutch.Rig.paper()" and not the repr of a rig with all its parts.
autodoc_preserve_defaults = True
# The model objects have many parameters: one to a line.
python_maximum_signature_line_length = 88


def _folders_as_text(app, doctree):
    """Links to folders of the repository, which no page can show, become plain text.

    Files outside of docs/ become downloads by themselves. Any other missing target is still a warning.
    """
    for link in list(doctree.findall(addnodes.pending_xref)):
        if link["reftype"] == "myst":
            page = Path(app.env.doc2path(link["refdoc"]))
            if (page.parent / link["reftarget"]).is_dir():
                link.replace_self(link.children)


def _no_type_in_front(app, what, name, obj, options, lines):
    """Keep napoleon from taking "Voltage: …", the first line of a property, for the property's type."""
    if what in ("attribute", "property"):
        lines.insert(0, "")


def setup(app):
    app.connect("autodoc-process-docstring", _no_type_in_front, priority=400)  # before napoleon, at 500
    app.connect("doctree-read", _folders_as_text)
