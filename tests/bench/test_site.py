"""The site has no dead link and no missing picture, and its search finds what is in it, in a browser."""

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.parse import unquote, urldefrag

from playwright.sync_api import sync_playwright
from support.nightly import nightly
from support.script import load

FLAGS = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking".split()


class _Html(HTMLParser):
    """Collects where a page leads, and what of it can be led to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors = {"", "__top"}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("href", "src"):
                self.links.append(value or "")
            elif name in ("id", "name"):
                self.anchors.add(value or "")


def dead(site: Path) -> list[str]:
    """Return links within the site that lead nowhere."""
    pages = {path: _Html(path.read_text(encoding="utf-8")) for path in site.rglob("*.html") if path.name != "404.html"}
    found = []
    for path, page in pages.items():
        for link in page.links:
            if re.match(r"[a-z]+:", link):
                continue
            place, anchor = urldefrag(unquote(link))
            target = (path.parent / place).resolve() if place else path
            target = target / "index.html" if target.is_dir() else target
            there = target.is_file() and (target not in pages or anchor in pages[target].anchors)
            found += [] if there else [f"{path.relative_to(site)}: {link}"]
    return found


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *words: object) -> None:
        pass


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """Yield the address at which a folder is served."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder))) as server:
        thread = Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def test_dead_links_are_found(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text('<a href="b.html#x"></a><a href="#y"></a><img src="c.png"><a href="http://x">')
    (tmp_path / "b.html").write_text('<p id="x"><a href="a.html"></a>')
    assert dead(tmp_path) == ["a.html: #y", "a.html: c.png"]


@nightly
def test_the_site_in_a_browser() -> None:
    """`make chromium` installs the browser."""
    site = load("website")
    site.build()
    assert dead(site.SITE) == []
    text = "".join(path.read_text(encoding="utf-8") for path in site.SITE.rglob("*.html"))
    assert not re.search(r"fonts\.g|<code>[^<]*\\\|", text)
    assert "[4&#124;2&#124;1]" in text
    with sync_playwright() as playwright, served(site.SITE) as address:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        page = browser.new_page()
        for path in (path for path in sorted(site.SITE.rglob("*.html")) if "<img" in path.read_text(encoding="utf-8")):
            page.goto(f"{address}/{path.relative_to(site.SITE)}")
            missing = "[...document.images].filter(one => !one.naturalWidth).map(one => one.src)"
            assert page.evaluate(missing) == [], path
        page.goto(f"{address}/index.html")
        page.locator(".md-search__button").click()
        page.get_by_role("combobox").fill("standstill")
        found = page.locator("[role=listbox] a")
        found.first.wait_for()
        hrefs = " ".join(link.get_attribute("href") or "" for link in found.all())
        assert re.search(r"(concepts|guides|reference)/", hrefs), hrefs
        browser.close()
