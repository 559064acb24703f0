"""The examples as notebooks: their cells, executed, and as pages of the documentation site.

`python docs/site/notebooks.py FOLDER [NAME ...]` executes the examples and writes the notebooks.
MkDocs loads this file as a hook: each example has a page, with the outputs of the notebooks in
build/notebooks where there are some; `make docs` writes them before.
"""

import html
import os
import re
import sys
import tempfile
from base64 import b64decode
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "examples"
EXECUTED = Path(os.environ.get("NOTEBOOKS", ROOT / "build" / "notebooks"))
SECONDS = 600  # that a cell may take
_CELL = re.compile(r"^# %%(.*)\n", re.MULTILINE)
_FRAME = re.compile(r'<iframe srcdoc="([^"]*)"')


def cells_of(text: str) -> list[tuple[str, str]]:
    """Return kind, "markdown" or "code", and source of each cell of a script; see jupytext."""
    _, *parts = _CELL.split(text)
    cells = []
    for title, body in zip(parts[::2], parts[1::2], strict=True):
        if "[markdown]" not in title:
            cells.append(("code", body.strip("\n")))
        elif body.startswith('"""'):
            # The docstring of the script: its first line is the title.
            cells.append(("markdown", "# " + body.strip().strip('"').strip()))
        else:
            cells.append(("markdown", re.sub(r"^# ?", "", body, flags=re.MULTILINE).strip()))
    return cells


def notebook_of(script: Path) -> Any:
    """Return a script with cells as a notebook without outputs."""
    from nbformat import v4

    new = {"markdown": v4.new_markdown_cell, "code": v4.new_code_cell}
    cells = []
    for number, (kind, source) in enumerate(cells_of(script.read_text(encoding="utf-8"))):
        cells.append(new[kind](source, id=f"cell-{number}"))
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return v4.new_notebook(cells=cells, metadata={"kernelspec": kernel})


def execute(notebook: Any, folder: Path) -> Any:
    """Execute the notebook in `folder` and return it with its outputs; an error is raised."""
    from nbclient import NotebookClient

    metadata = {"metadata": {"path": str(folder)}}
    return NotebookClient(notebook, timeout=SECONDS, resources=metadata).execute()


def page_of(notebook: Any, name: str) -> tuple[str, dict[str, bytes]]:
    """Return a notebook as Markdown, and the files that it shows by their names."""
    parts, files = [], {}
    for number, cell in enumerate(notebook.cells):
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            continue
        parts.append(f"```python\n{cell.source}\n```")
        for k, output in enumerate(cell.outputs):
            stem = f"{name}.{number}.{k}"
            data = output.get("data", {})
            if output.output_type == "stream":
                parts.append(f"```text\n{output.text.rstrip()}\n```")
            elif frame := _FRAME.search(data.get("text/html", "")):
                files[f"{stem}.html"] = html.unescape(frame[1]).encode()
                parts.append(
                    f'<iframe src="{stem}.html" title="recording" width="100%" height="480" '
                    'loading="lazy" style="border: 0"></iframe>'
                )
            elif "text/html" in data:
                parts.append(data["text/html"])
            elif "image/png" in data:
                files[f"{stem}.png"] = b64decode(data["image/png"])
                parts.append(f"![Figure of the cell above]({stem}.png)")
            elif "text/plain" in data:
                parts.append(f"```text\n{data['text/plain']}\n```")
    return "\n\n".join(parts) + "\n", files


def on_files(files: Any, config: Any) -> Any:
    """Give each example a page, and the files that it shows: called by MkDocs."""
    import nbformat
    from mkdocs.structure.files import File

    for script in sorted(EXAMPLES.glob("*.py")):
        executed = EXECUTED / f"{script.stem}.ipynb"
        shown: dict[str, bytes | str]
        if executed.is_file() and executed.stat().st_mtime >= script.stat().st_mtime:
            text, found = page_of(nbformat.read(executed, 4), script.stem)
            shown = {**found, executed.name: executed.read_bytes()}
            links = f"[script]({script.name}), [notebook]({executed.name})"
        else:
            text, shown = page_of(notebook_of(script), script.stem)[0], {}
            links = f"[script]({script.name}); `make docs` executes it and shows the outputs"
        title, _, rest = text.partition("\n")
        shown[f"{script.stem}.md"] = f"{title}\n\n*Download: {links}.*\n{rest}"
        for name, content in shown.items():
            files.append(File.generated(config, f"examples/{name}", content=content))
    return files


def main(folder: Path, *names: str) -> None:
    """Execute the examples, by default all, and write the notebooks."""
    import nbformat

    folder.mkdir(parents=True, exist_ok=True)
    for script in sorted(EXAMPLES.glob("*.py")):
        if names and script.stem not in names:
            continue
        with tempfile.TemporaryDirectory() as place:
            notebook = execute(notebook_of(script), Path(place))
        nbformat.write(notebook, folder / f"{script.stem}.ipynb")
        print(folder / f"{script.stem}.ipynb")


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
