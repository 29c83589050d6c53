"""Names, units and rows are found among the first lines of a text, whatever is above them."""

import pytest

from tachometry.sim.captures.text_layout import sniff

A, B = "0.5,0,1", "1.5,1,1"
SCOPE = "Model,MSO44\nHorizontal Units,s\nLabel,,\nTIME,CH1,CH2"


@pytest.mark.parametrize(
    ("head", "rows", "time", "found"),
    [
        # head, rows, --time; then separator, names, units, and how many lines are above the rows
        ("time,a,b", [A, B], None, (",", "time,a,b", "", 1)),
        ("time;a;b", ["0,5;0;1", "1,5;1;1"], None, (";", "time,a,b", "", 1)),
        ("time\ta\tb", ["0.5\t0\t1"], None, ("\t", "time,a,b", "", 1)),
        ("time a b", ["  0.5  0  1", "1.5 1 1"], None, (" ", "time,a,b", "", 1)),
        ('"time";"a;b"', ["0,5;0"], None, (";", "time,a;b", "", 1)),
        ("a,b,c", ["0,1,0"], None, (",", "a,b,c", "", 1)),
        ("when,a,b", [A], "when", (",", "when,a,b", "", 1)),
        ("note,a\nwhen,a", ["0.5,1"], "WHEN", (",", "when,a", "", 2)),
        ("", [A, B], "0", (",", None, "", 0)),
        ("\n\n", [A, B], "0", (",", None, "", 3)),
        ("#time,a,b", [A, B], None, (",", "time,a,b", "", 1)),
        ("; of mine\n# x,y,z\n#\n", [A], "0", (",", None, "", 4)),
        ("# time,x,y\ntime,a,b", [A], None, (",", "time,a,b", "", 2)),
        ("time,a,b,", [A + ","], None, (",", "time,a,b", "", 1)),
        (",time,a,b", ["0," + A], None, (",", ",time,a,b", "", 1)),
        ("time,a,b\ns,V,V", [A], None, (",", "time,a,b", "s,V,V", 2)),
        ("Time,CH1,CH2\ns,,", [A], None, (",", "Time,CH1,CH2", "s,,", 2)),
        ("x-axis,1,2\nsecond,Volt,Volt", [A], None, (",", "x-axis,1,2", "second,Volt,Volt", 2)),
        ("X,CH1,Increment\nSequence,Volt,5e-4", ["0,1.5,"], None, (",", "X,CH1,Increment", "Sequence,Volt,5e-4", 2)),
        ("X,CH1,Increment,\nSequence,Volt,5,4", ["0,1.5,,"], None, (",", "Sequence,Volt,5,4", "", 2)),
        ("1,2,on,my,bench\ntime,a,b", [A], None, (",", "time,a,b", "", 2)),
        ("Source,CH1,CH2\nSecond,Volt,Volt", [A], None, (",", "Source,CH1,CH2", "Second,Volt,Volt", 2)),
        (SCOPE, [A], None, (",", "TIME,CH1,CH2", "", 4)),
        ("time,a,b\nMARK 000", [A, "MARK 001", B], None, (",", "time,a,b", "", 2)),
        ("time,a,b", [], None, (",", "time,a,b", "", 1)),
        ("time,a,b", ["yes,0,1"], None, (",", "time,a,b", "", 1)),
        ("timestamp,a,b", ["2025-06-01T12:59:59.9Z,0,1"], None, (",", "timestamp,a,b", "", 1)),
        ("time,a,b", ["0.5,False,X"], None, (",", "time,a,b", "", 1)),
        ("time_us", ["700", "3200"], None, (",", "time_us", "", 1)),
        ("Time [ms]\nhh:mm:ss.ms", ["0:00:01.5"], None, (",", "Time [ms]", "hh:mm:ss.ms", 2)),
        ("", ["700", "3200"], "0", (",", None, "", 0)),
        ("Time,A,B,n\ns,,,rpm", ["0.5,0,1,300"], None, (",", "Time,A,B,n", "s,,,rpm", 2)),
        ("Time,A,B\n,Flag,Flag", ["0.5,On,Off", "1.5,On,On"], None, (",", "Time,A,B", ",Flag,Flag", 2)),
        ("when,A,n\nms,bit,kPa", [A], "when", (",", "when,A,n", "ms,bit,kPa", 2)),
        ('"# made by hand, of 5"\ntime,a,b', [A], None, (",", "time,a,b", "", 2)),
    ],
)
def test_the_head_of_a_text(
    head: str, rows: list[str], time: str | None, found: tuple[str, str | None, str, int]
) -> None:
    lines = [line + "\n" for line in [*(head.split("\n") if head else []), *rows]]
    table = sniff(lines, time)
    assert table is not None
    names = None if table.names is None else ",".join(table.names)
    assert (table.separator, names, ",".join(table.units), table.start) == found
    cells = [cell for row in rows[:1] for cell in row.replace('"', "").split(None if found[0] == " " else found[0])]
    assert table.first == cells


@pytest.mark.parametrize("text", ["", "\n\n", "# only\n; comments\n", "words without end\n", "time\n", "a,b\n"])
def test_what_has_no_table(text: str) -> None:
    assert sniff(text.splitlines(keepends=True)) is None


def test_comments_are_kept_for_what_is_in_them() -> None:
    table = sniff(["; Samplerate: 4 kHz\n", "a,b\n", "#  so\n", "0,1\n", "# later\n"])
    assert table is not None
    assert table.comments == ["Samplerate: 4 kHz", "so"]
