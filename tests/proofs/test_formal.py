"""CI proves `make formal-quick`."""

from proofs.formal.cases import PROOFS, QUICK


def test_a_quick_proof_for_every_checker() -> None:
    checkers = {proof.name: proof.checker for proof in PROOFS}
    assert len(checkers) == len(PROOFS)
    assert {checkers[name] for name in QUICK} == {*checkers.values()}
