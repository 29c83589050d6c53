"""Writes the figures of docs/measured/evidence.md from the tables beside it."""

from pages import MEASURED, block, markdown, read_table, write_block

COUNTED = ("clocks", "updates", "mismatches")
PAGE, TABLES = MEASURED / "evidence.md", MEASURED / "tables"


def results() -> dict[str, str]:
    """Return the summary of each table."""

    def total(name: str, column: str) -> str:
        rows = [row for row in read_table(TABLES / f"{name}.csv") if ", all" not in row.get("core", "")]
        return f"{sum(int(row[column]) for row in rows):,}"

    def ends(name: str, column: str) -> str:
        numbers = sorted((row[column].split()[0] for row in read_table(TABLES / f"{name}.csv")), key=float)
        return f"{numbers[0]} to {numbers[-1]}"

    proofs = read_table(TABLES / "proofs.csv")
    properties = {name for row in proofs for name in row["properties"].split(", ") if name}
    wrong = [name for row in proofs for name in row["wrong cores refuted in"].split(", ") if name]
    proven = sum(row["verdict"] == "proven" for row in proofs)
    sums = read_table(TABLES / "toggles.csv")[-1]
    speeds = (f"{ends('engines', name)} with {name}" for name in ("pysim", "verilator", "cxxrtl"))
    bitstreams = (f"{row['Fmax (MHz)']} MHz for {row['clock (MHz)']}" for row in read_table(TABLES / "boards.csv"))
    return {
        "proofs": f"{proven} of {len(proofs)} proven, {len(properties)} properties; {len(wrong)} wrong cores refuted",
        **{
            name: ", ".join(f"{total(name, one)} {one}" for one in COUNTED) for name in ("verify", "verify-every-clock")
        },
        "mutation": f"{total('mutation', 'killed')} of {total('mutation', 'mutants')} wrong cores are noticed, "
        f"{ends('mutation', 'score')} %",
        "upsets": f"{total('upsets', 'upsets')} upsets; the outputs are wrong for {ends('upsets', 'worst')} ticks at "
        f"most; bounds are {ends('upsets', 'bound')}",
        "toggles": f"{sums['reference']} flip-flops change in a tick of `reference`, {sums['table']} of `table`",
        "golden": f"golden models run {ends('golden', 'clocks/s')} clocks a second",
        "engines": f"clocks a second: {', '.join(speeds)}",
        "whole": f"{ends('whole', 'ratio')} times as fast by skipping idle clocks",
        "boards": f"Fmax {', '.join(bitstreams)}",
    }


def summary() -> str:
    """Return the table of all results."""
    return markdown(
        ["table", "result"], [[f"[{name}](tables/{name}.csv)", text] for name, text in results().items()], (0, 1)
    )


if __name__ == "__main__":
    if block(PAGE, "summary") != summary():
        write_block(PAGE, "summary", summary())
