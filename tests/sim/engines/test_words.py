"""Operations on the words of words.h give what those of CXXRTL's own header give, at random widths and values."""

import random
from pathlib import Path

import pytest
from support.compiled import HEADERS
from support.nightly import only

from tachometry.sim.build import compiler, run
from tachometry.sim.engines.cxxrtl import WORDS

_WIDTHS = (1, 2, 5, 31, 32, 33, 63, 64, 65, 100, 128, 135, 200)
_TEST = """
static std::mt19937_64 chance(1);
template <size_t N> void draw(cxxrtl::value<N> &a, own::value<N> &b) {{
  int how = chance() % 4;
  for (auto &chunk : a.data) chunk = how == 0 ? 0 : how == 1 ? ~0u : chance();
  a.data[a.chunks - 1] &= a.msb_mask;
  b = own::value<N>();
  for (size_t k = 0; k < a.chunks; k++) b.word = b.word | own::Word<N>(a.data[k]) << 32 * k;
}}
template <size_t N> void compare(const char *name, const cxxrtl::value<N> &a, const own::value<N> &b) {{
  bool same = !bool(b.word & ~own::value<N>::ones());
  for (size_t k = 0; k < a.chunks; k++) same &= a.data[k] == uint32_t(uint64_t(b.word >> 32 * k));
  if (!same) puts(name);
}}
template <class A, class B> void copy(A &a, B &b, A from, B own_from) {{ a = from; b = own_from; }}
int main() {{ {cases} }}
"""
_CASE = """{{ cxxrtl::value<{a}> a; own::value<{a}> p; cxxrtl::value<{b}> b; own::value<{b}> q; cxxrtl::value<{part}> c;
own::value<{part}> r; for (int k = 0; k < 100; k++) {{ draw(a, p); draw(b, q); draw(c, r); {same} {first};
compare("{second}", {first_value}, {second}); }} }}"""


def _case(chance: random.Random, operation: str) -> str:
    """Return a comparison in C++: a and b have random widths, c those of bits `stop` to `start` of a."""
    a, b, result = (chance.choice(_WIDTHS if operation[:3] != "mul" else _WIDTHS[:11]) for _ in range(3))
    if operation[:3] == "mul":
        result = max(a, b, result)
    if chance.random() < 0.3:
        b = a
    start = chance.randrange(a)
    stop = chance.randrange(start, a)
    if operation[:2] in ("eq", "ne", "lt", "le", "gt", "ge", "lo", "re"):
        result = 1
    first, left, right = "", f"cxxrtl_yosys::{operation}<{result}>(a, b)", f"own::{operation}<{result}>(p, q)"
    match operation:
        case "slice":
            left, right = (f"{one}.slice<{stop}, {start}>().val()" for one in "ap")
        case "concat":
            left, right = "a.concat(b).val()", "p.concat(q).val()"
        case "repeat":
            left, right = (f"{one}.slice<0>().val().repeat<{b}>().val()" for one in "ap")
        case "assign":
            first = f"a.slice<{stop}, {start}>() = c; own::assign(r, p.part<{stop}, {start}>())"
            left, right = "a", "p"
        case "not_u" | "neg_u" | "neg_s" | "logic_not" | "reduce_or" | "reduce_bool" | "reduce_and" | "reduce_xor":
            left, right = f"cxxrtl_yosys::{operation}<{result}>(a)", f"own::{operation}<{result}>(p)"
    same = "if (k % 4 == 0) copy(b, q, a, p);" if a == b else ""
    part = stop - start + 1
    return _CASE.format(a=a, b=b, part=part, same=same, first=first, first_value=left, second=right)


@pytest.mark.parametrize("seed", only([0], range(2)))
def test_it_is_what_cxxrtl_computes(seed: int, tmp_path: Path) -> None:
    chance = random.Random(seed)
    both = [f"{name}_{sign}" for name in "and or xor add sub mul eq ne lt le gt ge".split() for sign in ("uu", "ss")]
    single = "not_u neg_u neg_s logic_not reduce_or reduce_bool reduce_and reduce_xor".split()
    rest = ["shl_uu", "shr_uu", "shift_uu", "slice", "slice", "concat", "concat", "repeat", "assign", "assign"]
    cases = [_case(chance, operation) for operation in (*both, *single, *rest)]
    heads = "".join(line for line in WORDS.splitlines(keepends=True) if line.startswith("#include"))
    own = "".join(line for line in WORDS.splitlines(keepends=True) if not line.startswith(("#include", "#define CXX")))
    text = f"#include <cxxrtl/cxxrtl.h>\n#include <random>\n{heads}namespace own {{\n{own}}}\n"
    (tmp_path / "test.cc").write_text(text + _TEST.format(cases="\n".join(cases)), encoding="utf-8")
    run([*compiler(), "-std=c++17", "-w", f"-I{HEADERS}", "-o", "test", "test.cc"], "compiler", tmp_path)
    assert run([tmp_path / "test"], "the test") == ""
