"""The page in Chromium, as users have it; without a browser test_page.py and test_live.py have all that it asks."""

import os
import shutil
import socket
from collections.abc import Iterator
from pathlib import Path
from urllib.request import urlopen
from zipfile import ZipFile

import psutil
import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright
from support.command import run
from support.explored import explored
from support.nightly import nightly

from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder

pytestmark = nightly

FLAGS = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking".split()
CORE = "#ppr=24&clock=12MHz&tick=100us&max-time=1ms&max-speed=500rad/s&method=m"
SLOW = 120_000.0  # milliseconds in which a board is compiled


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        yield chromium
        chromium.close()


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """Return that of the page; when it ends, nothing is left of it: no process, and no file."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    with explored(folder) as (process, found):
        yield found
        children = psutil.Process(process.pid).children(recursive=True)
        process.terminate()
        _, err = process.communicate(timeout=60)
    said = [line for line in err.splitlines() if not line.startswith("compiling, ")]  # which tells how long it takes
    assert (process.returncode, said) == (0, [])
    assert [child for child in children if child.is_running()] == []
    assert os.listdir(folder) == []


@pytest.fixture
def page(browser: Browser, address: str) -> Iterator[Page]:
    """Return the page with a core; nothing goes wrong in it, and it asks nobody else."""
    faults: list[str] = []
    with browser.new_context() as context:
        opened = context.new_page()
        opened.on("pageerror", lambda error: faults.append(str(error)))
        opened.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
        opened.on(
            "request",
            lambda sent: None if sent.url.startswith((address, "data:", "blob:")) else faults.append(sent.url),
        )
        opened.goto(address + CORE)
        expect(opened.locator("#symbol svg")).to_be_visible()
        yield opened
    assert faults == []


def test_the_archive_has_what_the_command_writes(page: Page, tmp_path: Path) -> None:
    page.get_by_label("ppr", exact=True).fill("500")
    page.get_by_label("method", exact=True).select_option("mt")
    page.get_by_label("bus", exact=True).select_option("apb")
    page.locator("summary", has_text="Files").click()
    page.get_by_label("name", exact=True).fill("spindle")
    expect(page.locator("#command")).to_contain_text("--name spindle")
    with page.expect_download(timeout=SLOW) as download:
        page.get_by_role("button", name="Download zip").click()
    download.value.save_as(tmp_path / "found.zip")
    assert download.value.suggested_filename == "spindle.zip"
    words = (page.locator("#command").text_content() or "").split()
    assert run(*words[1:-1], tmp_path / "core") == 0
    with ZipFile(tmp_path / "found.zip") as archive:
        found = {name: archive.read(name) for name in archive.namelist()}
    assert found == {path.name: path.read_bytes() for path in (tmp_path / "core").iterdir()}


def test_what_is_wrong_is_said_beside_the_field(page: Page) -> None:
    field = page.get_by_label("max time", exact=True)  # its group is open, as it is given
    field.fill("5")
    expect(page.locator("#o-max-time-error")).to_contain_text("--max-time must have a unit")
    expect(field).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_role("button", name="Download zip")).to_be_disabled()
    page.locator("summary", has_text="Timing").click()
    page.get_by_label("ppr", exact=True).fill("0")  # what is shown of a closed group opens it
    expect(page.locator("#o-ppr-error")).not_to_be_empty()
    page.get_by_label("ppr", exact=True).fill("24")
    expect(field).to_be_visible()
    field.fill("2ms")
    expect(page.locator("#o-max-time-error")).to_be_empty()
    expect(page.get_by_role("button", name="Download zip")).to_be_enabled()
    page.get_by_label("Motion as --motion has it").fill("ramp:0:1")
    expect(page.locator("#o-motion-error")).to_contain_text("--motion segment must be one of")


def test_keys_reach_everything(page: Page) -> None:
    """From the link that skips the form; Enter in a field sends nothing."""
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Skip to the core")).to_be_focused()
    page.keyboard.press("Tab")
    expect(page.get_by_role("button", name="Download zip")).to_be_focused()
    page.keyboard.press("Tab")
    page.keyboard.press("Tab")
    expect(page.get_by_label("ppr", exact=True)).to_be_focused()
    expect(page.locator("#o-ppr-help")).to_contain_text("Pulses per revolution")
    page.keyboard.press("Control+A")
    page.keyboard.type("36")
    page.keyboard.press("Enter")
    expect(page.locator("#command")).to_contain_text("--ppr 36")
    for box in page.get_by_role("checkbox").all():
        assert box.get_attribute("id")
    assert "ppr=36" in page.url
    page.reload()
    expect(page.get_by_label("ppr", exact=True)).to_have_value("36")


def test_curves_and_motions_and_captures(page: Page, tmp_path: Path) -> None:
    expect(page.locator("#errors canvas")).to_be_visible()
    expect(page.locator("#methods tr.own")).to_contain_text("m")
    expect(page.locator("#scores tr", has_text="hostmot2")).to_be_visible()
    page.locator("#velocity .u-over").hover()
    expect(page.locator("#scores tr.own td").last).not_to_be_empty()
    page.get_by_label("hostmot2").uncheck()
    page.get_by_label("Motion", exact=True).select_option(label="sine")
    expect(page.get_by_label("Motion as --motion has it")).to_have_value("sine:450rad/s:20Hz:0.2s")
    capture = tmp_path / "run.csv"
    capture.write_text("time,a,b\n" + "".join(f"{n / 1e4},{n // 2 % 2},{(n + 1) // 2 % 2}\n" for n in range(300)))
    page.locator("#file").set_input_files(capture)
    expect(page.locator("#replayed")).to_contain_text("run.csv is replayed")
    expect(page.locator("#deviation")).to_be_hidden()
    page.locator("summary", has_text="The disc").click()
    page.get_by_role("button", name="Measure the disc").click()
    expect(page.locator("#disc-error")).to_contain_text("captures must have more than 4 turns of 96 counts")
    coast = tmp_path / "coast.sr"
    recording = VirtualEncoder(24, eccentricity=0.25).record(parse_motion("ramp:150rad/s:60rad/s:3s")).recording
    write_sr(coast, recording.place(2_000_000), 2_000_000)
    page.locator("#file").set_input_files(coast)
    expect(page.locator("#replayed")).to_contain_text("coast.sr is replayed")
    page.get_by_role("button", name="Measure the disc").click()
    expect(page.locator("#disc-rows")).to_contain_text("the map can be used")
    expect(page.locator("#disc-picture")).to_be_visible()
    expect(page.get_by_role("link", name="disc.json")).to_be_visible()


def test_a_simulated_board_is_shown_live(page: Page) -> None:
    page.get_by_role("button", name="Start").click()
    expect(page.locator("#measured dd").first).to_be_visible(timeout=SLOW)
    page.get_by_label("speed", exact=True).fill("-200")
    expect(page.locator("#now")).to_contain_text("-", timeout=SLOW)
    expect(page.locator("#running canvas")).to_be_visible()
    page.get_by_role("button", name="Stop").click()
    expect(page.locator("#told")).to_have_text("stopped")
    page.get_by_role("button", name="Start").click()
    expect(page.locator("#told")).to_contain_text("connected", timeout=SLOW)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_telephone(browser: Browser, address: str, scheme: str) -> None:
    with browser.new_context(viewport={"width": 360, "height": 740}, color_scheme=scheme) as context:  # type: ignore[arg-type]
        opened = context.new_page()
        opened.goto(address + CORE)
        expect(opened.locator("#velocity canvas")).to_be_visible()
        assert opened.evaluate("document.documentElement.scrollWidth") <= 360
        ground = opened.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (sum(map(int, ground[4:-1].split(","))) < 200) == (scheme == "dark")


def test_many_pages(browser: Browser, address: str) -> None:
    """Twenty tabs at once, and clients that never read, send nothing, or are gone."""
    host, token = address.split("/")[2:4]
    name, port = host.split(":")
    clients = [socket.create_connection((name, int(port))) for _ in range(100)]
    for number, client in enumerate(clients):
        if number % 2:
            client.sendall(f"GET /{token}/uPlot.iife.min.js HTTP/1.1\r\nHost: {host}\r\n\r\n".encode() * 10)
        if number % 5 == 0:
            client.close()
    with browser.new_context() as context:
        pages = [context.new_page() for _ in range(20)]
        for opened in pages:
            opened.goto(address + CORE)
        for opened in pages:
            expect(opened.locator("#scores tr.own")).to_be_visible(timeout=SLOW)
    for client in clients:
        client.close()


def test_more_clients_than_are_served(address: str) -> None:
    host = address.split("/")[2]
    name, port = host.split(":")
    clients = [socket.create_connection((name, int(port))) for _ in range(1000)]
    clients[-1].sendall(f"GET {address.split(host)[1]} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
    assert clients[-1].recv(100).startswith(b"HTTP/1.1 200 ")
    for client in clients:
        client.close()
    with urlopen(address) as reply:
        assert reply.status == 200
