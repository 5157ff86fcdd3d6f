import math

from railcosim.studies.ledger import every, less, number, verdict


def test_verdicts() -> None:
    assert verdict({"a": True, "b": True}) == "holds"
    assert verdict({"a": False, "b": False}) == "does not hold"
    assert verdict({"a is so": True, "b": False, "c is so": True}) == "holds if a is so or c is so"
    assert verdict({"a": True, "b": None}) == "cannot be verified"
    assert verdict({}) == "cannot be verified"
    assert verdict(True) == "holds"
    assert verdict(False) == "does not hold"
    assert verdict(None) == "cannot be verified"


def test_comparisons_pass_on_what_is_unknown() -> None:
    assert less(1.0, 2.0) is True
    assert less(2.0, 2.0) is False
    assert less(None, 2.0) is None
    assert less(0.97, 1.0, margin=0.05) is False
    assert less(math.inf, math.inf) is False
    assert every(True, False) is False
    assert every(True, None) is None


def test_numbers_in_sentences() -> None:
    assert number(1.234, "s") == "1.23 s"
    assert number(None, "s") == "never"
