"""CI proves `make formal-quick`."""

import inspect
import sys

from proofs.formal.cases import PROOFS, QUICK
from proofs.formal.mutants import MUTANTS


def test_a_quick_proof_for_every_checker() -> None:
    checkers = {proof.name: proof.checker for proof in PROOFS}
    assert len(checkers) == len(PROOFS)
    assert {checkers[name] for name in QUICK} == {*checkers.values()}


def test_every_mutant_stands_in_its_box() -> None:
    """`make formal` asks so of each, but it takes long."""
    sources = [(one, inspect.getsource(sys.modules[one.box.__module__])) for one in MUTANTS]
    assert [one for one, source in sources if source.count(one.right) != 1] == []
