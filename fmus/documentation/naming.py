"""Names and numbers in MathML."""

import math
import re
from collections.abc import Iterable
from html import escape

_GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "zeta": "ζ",
    "eta": "η", "theta": "θ", "kappa": "κ", "lambda": "λ", "lam": "λ", "mu": "μ", "nu": "ν",
    "xi": "ξ", "pi": "π", "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "chi": "χ",
    "psi": "ψ", "omega": "ω", "Gamma": "Γ", "Delta": "Δ", "Theta": "Θ", "Lambda": "Λ",
    "Xi": "Ξ", "Pi": "Π", "Sigma": "Σ", "Phi": "Φ", "Psi": "Ψ", "Omega": "Ω",
}  # fmt: skip
_PI = {
    math.pi: "<mi>π</mi>",
    2.0 * math.pi: "<mrow><mn>2</mn><mo>&#8290;</mo><mi>π</mi></mrow>",
    math.pi / 2.0: "<mfrac><mi>π</mi><mn>2</mn></mfrac>",
    math.pi / 180.0: "<mfrac><mi>π</mi><mn>180</mn></mfrac>",
    180.0 / math.pi: "<mfrac><mn>180</mn><mi>π</mi></mfrac>",
}
_DOT = '<mo lspace="0" rspace="0">.</mo>'
_NOISE = 16  # significant digits from which on a number may be a simpler one, rounded
_ROUNDING = 4e-16
_CANCELLATION = 1e-13  # how far a difference may be from a number of four digits


def identifier(name: str, index: str = "") -> str:
    """Return a variable's name in MathML, with an index (MathML) where one belongs.

    A single letter or a Greek one takes what follows its underscore as a subscript; other
    names stay as they are, so that they are found in a tool.
    """
    parts = name.split(".")
    if index and "[]" not in name:
        parts[-1] += "[]"
    shown = [_part(part.removesuffix("[]"), index if "[]" in part else "") for part in parts]
    return shown[0] if len(shown) == 1 else f"<mrow>{_DOT.join(shown)}</mrow>"


def _part(name: str, index: str) -> str:
    head, _, rest = name.partition("_")
    if rest and (len(head) == 1 or head in _GREEK):
        name = head
        below = f"<mi>{escape(_GREEK.get(rest, rest))}</mi>"
    else:
        below = ""
    letter = f"<mi>{escape(_GREEK.get(name, name))}</mi>"
    subscripts = [s for s in (below, index) if s]
    if not subscripts:
        return letter
    row = subscripts[0] if len(subscripts) == 1 else f"<mrow>{'<mo>,</mo>'.join(subscripts)}</mrow>"
    return f"<msub>{letter}{row}</msub>"


def has_letter(name: str) -> bool:
    """Return whether a name is shown as one letter, perhaps with a subscript."""
    head = name.partition("_")[0]
    return "." not in name and (head in _GREEK or len(head) == 1)


def free_letters(names: Iterable[str], count: int) -> list[str]:
    """Return letters that no variable bears, for running indices; at most three."""
    taken = {re.split(r"[._\[]", name)[0] for name in names}
    return [letter for letter in "ijknlmpqrsιυϑ" if letter not in taken][:count]


def free_letter(names: Iterable[str]) -> str:
    """Return a letter that no variable bears, for abbreviations."""
    taken = {re.split(r"[._\[]", name)[0] for name in names}
    return next(letter for letter in "abcfghwyzABCEHQRSWYZϱ" if letter not in taken)


def number(value: float) -> str:
    """Return a number as text as short as it can be: 2, 0.1, 1e-6, 2.1e11."""
    # + 0.0 takes the sign off −0.
    mantissa, _, power = repr(float(value) + 0.0).partition("e")
    mantissa = mantissa.removesuffix(".0")
    exponent = int(power or 0)
    sign = "-" if mantissa.startswith("-") else ""
    digits = mantissa.removeprefix("-")
    if digits.isdigit() and len(digits) > 7 and digits.endswith("0000"):
        exponent += len(digits) - 1
        digits = digits[0] + ("." + digits[1:]).rstrip("0").rstrip(".")
    return f"{sign}{digits}e{exponent}" if exponent else f"{sign}{digits}"


def number_mathml(value: float) -> str:
    """Return a number that is not negative in MathML.

    Noise in the last digits goes: 0.1 + 0.2 is 0.3. Multiples of π are recognised, and so are
    reciprocals such as 1/3.6, and whole km/h.
    """
    if math.isinf(value):
        return "<mi>∞</mi>"
    if value in _PI:
        return _PI[value]
    text = number(value)
    if len(text.partition("e")[0].replace(".", "").lstrip("0")) >= _NOISE:
        short, rounded = float(f"{value:.4g}"), float(f"{value:.12g}")
        if math.isclose(short, value, rel_tol=_CANCELLATION):
            text = number(short)
        elif math.isclose(rounded, value, rel_tol=_ROUNDING):
            text = number(rounded)
        else:
            for above, below in (("1", f"{1.0 / value:.6g}"), (f"{3.6 * value:.4g}", "3.6")):
                is_plain = "e" not in above + below
                if is_plain and math.isclose(float(above) / float(below), value, rel_tol=_ROUNDING):
                    return f"<mfrac><mn>{above}</mn><mn>{below}</mn></mfrac>"
    mantissa, _, exponent = text.partition("e")
    if not exponent:
        return f"<mn>{mantissa}</mn>"
    sign = "<mo>−</mo>" if exponent.startswith("-") else ""
    power = f"<msup><mn>10</mn><mrow>{sign}<mn>{exponent.lstrip('-')}</mn></mrow></msup>"
    if mantissa == "1":
        return power
    return f"<mrow><mn>{mantissa}</mn><mo>×</mo>{power}</mrow>"
