"""The site built from ``docs/``: complete, without warnings, and without anybody else's servers."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FETCHED = re.compile(
    r"<(?:script|img|iframe|source)[^>]+src=\"(?:https?:)?//[^\"]+|"
    r"<link[^>]+href=\"(?:https?:)?//[^\"]+|@import[^;]+//|url\(\s*['\"]?https?://[^)]+",
)
"""What a browser loads by itself; a link is not among it."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built as ``make docs`` does, with no way out of this machine."""
    out = tmp_path_factory.mktemp("site")
    nowhere = {f"{scheme}_proxy": "http://127.0.0.1:9" for scheme in ("http", "https", "all")}
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--site-dir", str(out)],
        cwd=ROOT, env={**os.environ, **nowhere, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return out


def test_every_page_is_there_and_in_the_contents(site: Path) -> None:
    """None of ``docs/`` is left out, and the first page leads to every one."""
    pages = {p.relative_to(ROOT / "docs").with_suffix("") for p in (ROOT / "docs").rglob("*.md")}
    contents = (site / "index.html").read_text()
    for page in pages:
        assert (site / page).with_suffix(".html").is_file(), page
        assert f'href="{page}.html"' in contents or str(page) == "index", page


def test_nothing_is_fetched_when_it_is_read(site: Path) -> None:
    """No font, script, style or picture from another server."""
    for file in [*site.rglob("*.html"), *site.rglob("*.css")]:
        assert not FETCHED.findall(file.read_text()), file
    assert FETCHED.findall('<link rel="stylesheet" href="https://fonts.example/css">')
    assert FETCHED.findall('<script src="//cdn.example/x.js">')
