"""Puts the address of the repository into a copy of the project that is to be released."""

import re
from pathlib import Path

import click


def absolute(text: str, address: str, version: str) -> str:
    """Return a page whose links to files of the repository are those of the tag of this version."""
    text = re.sub(r"(!\[[^\]]*\])\((?!https?:|#)", rf"\1({address}/raw/v{version}/", text)
    return re.sub(r"\]\((?!https?:|#)", f"]({address}/blob/v{version}/", text)


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.argument("given", metavar="[ADDRESS [MAIL]]", nargs=-1)
def main(folder: Path, given: tuple[str, ...]) -> None:
    """Change pyproject.toml and README.md in FOLDER; what is not given is as pyproject.toml has it."""
    project = folder / "pyproject.toml"
    text = project.read_text(encoding="utf-8")
    known: list[str] = [re.findall(pattern, text)[0] for pattern in (r'Repository = "(.*)"', r'email = "(.*?)"')]
    if len(given) > len(known):
        raise click.UsageError(f"there must be an address and a mail at most, not {len(given)} words")
    now = [*given, *known[len(given) :]]
    address, mail = now[0].rstrip("/"), now[1]
    if "OWNER" in address + mail or not re.fullmatch(r"https://[\w./-]+", address):
        raise click.UsageError(
            "address of the repository and mail of the authors must be in pyproject.toml, instead of OWNER, or given: "
            f"make dist ADDRESS=https://… MAIL=…; they are {address} and {mail}"
        )
    for before, after in zip(known, (address, mail), strict=True):
        text = text.replace(before, after)
    project.write_text(text, encoding="utf-8")
    (version,) = re.findall(r'^version = "(.*)"', text, re.MULTILINE)
    page = folder / "README.md"
    page.write_text(absolute(page.read_text(encoding="utf-8"), address, version), encoding="utf-8")


if __name__ == "__main__":
    main()
