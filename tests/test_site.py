"""The documentation site: builds without a warning, makes no external requests, and is complete."""

import fcntl
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import sphshell_pin
from sphshell_pin import errors
from tests.programs import serving

for package in ("mkdocs", "material", "mkdocstrings"):
    pytest.importorskip(package, reason="needs the extra docs: mkdocs-material, mkdocstrings")

ROOT = Path(__file__).parent.parent
WIDE = ["index.html", "commands.html", "hard_cases.html"]
# What a browser loads by itself, other than what a reader clicks on.
LOADED = {("script", "src"), ("img", "src"), ("iframe", "src"), ("link", "href"), ("source", "src")}


class Page(HTMLParser):
    """The links, loaded files and anchors of a page."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.loaded: set[str] = set()
        self.anchors: set[str] = set()
        self.text: list[str] = []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        for key, value in attrs:
            if (tag, key) in LOADED:
                self.loaded.add(value)
            elif (tag, key) == ("a", "href"):
                self.links.add(value)
            elif key == "id":
                self.anchors.add(value)

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def built(tmp_path_factory, worker_id):
    """The folder of the site, which one process builds for all, and what mkdocs said."""
    base = tmp_path_factory.getbasetemp()
    shared = base if worker_id == "master" else base.parent
    site, said = shared / "site", shared / "site.log"
    with (shared / "site.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not said.exists():
            command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", site]
            # Examples without outputs, whatever notebooks there are.
            env = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "NOTEBOOKS": str(site / "none")}
            done = subprocess.run(
                command, cwd=ROOT, env=env, capture_output=True, text=True, check=False
            )
            said.write_text(f"exit code {done.returncode}\n{done.stderr}", "utf-8")
    return site, said.read_text("utf-8")


@pytest.fixture(scope="module")
def pages(built):
    site, _ = built
    return {file: Page(file) for file in site.rglob("*.html")}


def test_it_builds_without_a_warning(built):
    _, said = built
    assert said.startswith("exit code 0\n"), said
    assert "WARNING" not in said


def test_every_page_is_there_and_in_the_menu(built, pages):
    site, _ = built
    written = {page.relative_to(ROOT / "docs") for page in (ROOT / "docs").rglob("*.md")}
    written |= {Path("examples", f"{one.stem}.md") for one in (ROOT / "docs/examples").glob("*.py")}
    shown = {file.relative_to(site).with_suffix(".md") for file in pages} - {Path("404.md")}
    assert shown == written
    start = pages[site / "index.html"]
    assert {str(page.with_suffix(".html")) for page in written} <= start.links | {"index.html"}


def test_it_asks_nobody_for_anything(built, pages):
    site, _ = built
    for file, one in ((file, one) for file, page in pages.items() for one in page.loaded):
        assert not urlsplit(one).netloc, f"{file.name} loads {one}"
        # The page of wrong addresses names files from the root of the host.
        target = site / one.lstrip("/") if one.startswith("/") else file.parent / unquote(one)
        assert one.startswith("data:") or target.exists(), f"{file.name} loads {one}"
    for style in site.rglob("*.css"):
        text = style.read_text(encoding="utf-8")
        assert not re.search(r"(url\(|@import)\s*[\"']?(https?:)?//", text), style.name


def test_every_public_name_is_in_the_api(built, pages):
    site, _ = built
    anchors = set().union(*(pages[file].anchors for file in (site / "api").glob("*.html")))
    known = {one for one in anchors if one.startswith("sphshell_pin.")}
    names = {one.rpartition(".")[2] for one in known}
    assert {*sphshell_pin.__all__, *sphshell_pin.results.__all__} <= names
    own = {name for name, one in vars(errors).items() if isinstance(one, type)}
    own = {name for name in own if getattr(errors, name).__module__ == errors.__name__}
    assert {f"sphshell_pin.errors.{name}" for name in own if not name.startswith("_")} <= known
    # What a class inherits from one that has no page.
    inherited = ("model", "add_contact", "replace_pair", "dynamics_derivatives")
    assert {f"sphshell_pin.dynamics.Scene.{name}" for name in inherited} <= known


def test_meanings_of_parameters_do_not_pass_for_types(built, pages):
    site, _ = built
    text = " ".join("".join(pages[site / "api" / "shell.html"].text).split())
    assert re.search(r"crease_angle \(float, default: CREASE_ANGLE ?\) \S edges that turn", text)


@pytest.fixture
def address(built):
    with serving(built[0]) as port:
        yield f"http://127.0.0.1:{port}"


@pytest.mark.browser
@pytest.mark.parametrize("names", [WIDE, pytest.param(None, marks=pytest.mark.study)])
def test_it_fits_a_telephone_and_its_search_finds(built, browser, address, pages, names):
    context = browser.new_context(viewport={"width": 390, "height": 844})
    page = context.new_page()
    complaints: list[str] = []
    page.on("pageerror", lambda fault: complaints.append(str(fault)))
    page.on("response", lambda answer: answer.status < 400 or complaints.append(answer.url))
    own = (address, "data:")
    page.on("request", lambda one: one.url.startswith(own) or complaints.append(one.url))
    # Wide tables scroll in boxes of their own.
    inside = "[...document.querySelectorAll('.md-typeset table:not([class])')].every(t => "
    inside += "t.closest('.md-typeset__scrollwrap').getBoundingClientRect().right <= 390)"
    narrow = "document.documentElement.scrollWidth <= 390"
    shown = "[...document.images].every(i => i.complete && i.naturalWidth > 0)"
    for name in names or sorted(str(file.relative_to(built[0])) for file in pages):
        page.goto(f"{address}/{name}", wait_until="load")
        assert page.evaluate(f"[{narrow}, {inside}, {shown}]") == [True, True, True], name
    page.goto(f"{address}/index.html", wait_until="networkidle")
    page.locator("label[for=__search]").first.click()
    ready = "document.querySelector('.md-search-result__meta').textContent.includes('Type')"
    page.wait_for_function(ready)
    page.locator("input[name=query]").press_sequentially("BristleFriction")
    page.locator(".md-search-result__item a").first.wait_for()
    assert not complaints
    context.close()
