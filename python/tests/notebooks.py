"""Runs the notebooks of docs/notebooks and keeps what they show: `python python/tests/notebooks.py`."""

from __future__ import annotations

from pathlib import Path

import nbclient
import nbformat


def main() -> None:
    for path in sorted((Path(__file__).parents[2] / "docs" / "notebooks").glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(path.parent)}}).execute()
        for cell in notebook.cells:
            # When a cell ran says nothing to a reader.
            cell.metadata.pop("execution", None)
        notebook.metadata = {"kernelspec": notebook.metadata["kernelspec"], "language_info": {"name": "python"}}
        path.write_text(nbformat.writes(notebook, indent=1) + "\n", encoding="utf-8")
        print(path.name)


if __name__ == "__main__":
    main()
