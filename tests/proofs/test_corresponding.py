"""Flip-flops that never differ, on circuits of a few gates."""

from proofs.mutation.corresponding import corresponding
from proofs.mutation.gates import Gates, Levels, Place


def test_what_is_always_equal_opposite_or_constant_is_found() -> None:
    """And nothing that a clock after many others tells apart."""
    gates = Gates()
    pin, rst = gates.new(), gates.new()
    names = ("one", "same", "opposite", "zero", "high", *(f"n{bit}" for bit in range(12)), "late")
    places = {name: (f"q_{name}", 0) for name in names}
    begun: Levels = dict.fromkeys(places.values(), 0) | {places["opposite"]: 1, places["high"]: 1}
    anything = {place: gates.new() for place in begun}

    def clock(inner: Levels) -> Levels:
        now = {name: inner[place] for name, place in places.items()}
        after = {"one": gates.differ(now["same"], pin), "same": gates.differ(now["one"], pin)}
        after |= {"opposite": after["one"] ^ 1, "zero": gates.all_of(now["zero"], pin)}
        after |= {"high": gates.any_of(now["high"], pin)}
        carry = 1
        for bit in range(12):
            after[f"n{bit}"] = gates.differ(now[f"n{bit}"], carry)
            carry = gates.all_of(carry, now[f"n{bit}"])
        after["late"] = gates.any_of(now["late"], carry)  # after 4095 clocks
        found: dict[Place, int] = {}
        for name, place in places.items():
            found[place] = gates.all_of(after[name], rst ^ 1) if begun[place] == 0 else gates.any_of(after[name], rst)
        return found

    kept = corresponding(gates, anything, begun, clock)
    one = kept[places["one"]]
    assert one > 1
    assert kept[places["same"]] == one
    assert kept[places["opposite"]] == one ^ 1
    assert (kept[places["zero"]], kept[places["high"]]) == (0, 1)
    assert len({literal >> 1 for literal in kept.values()}) == len(names) - 3


def test_a_word_is_one_of_some() -> None:
    gates, words = Gates(), {0, 3, 6, 7, 12}
    told = [gates.one_of([word >> bit & 1 for bit in range(4)], words) for word in range(16)]
    assert {word for word, known in enumerate(told) if known} == words
