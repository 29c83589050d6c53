from support.simulate import clock_by_clock

from tachometry.hdl.bus import counter


def test_it_counts_and_saturates() -> None:
    """Counts to 7 in 3 bits, stays there, and begins anew; an event together with clear is not counted."""
    rows = [{"event": event, "clear": 0} for event in (1, 0, 1, 1, 1, 1, 1, 1, 1, 1)]
    rows += [{"event": 1, "clear": 1}, {"clear": 0}, {"event": 0}]
    seen = clock_by_clock(counter.SaturatingCounter(3), rows, ["count"])
    assert [row["count"] for row in seen] == [0, 1, 1, 2, 3, 4, 5, 6, 7, 7, 7, 0, 1]
