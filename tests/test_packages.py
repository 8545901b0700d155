"""What `pip install` puts into a folder that is not this checkout is complete."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("slam", "dynslam_env", "agents", "scripts")
NAMES = {"scripts": "dynslam_cli"}  # of folders that are installed under another name


def test_every_package_is_installed() -> None:
    """`dynslam_env.faults` was missing: nothing could be imported outside of a checkout."""
    told = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    found = {
        ".".join((NAMES.get(folder, folder), *made.parent.relative_to(ROOT / folder).parts))
        for folder in FOLDERS
        for made in (ROOT / folder).rglob("__init__.py")
    }
    assert found == set(told)
