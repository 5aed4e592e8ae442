"""Formulas of docstrings, LaTeX, as text that a terminal can show."""

from __future__ import annotations

import re

LETTERS = (
    "alpha α beta β gamma γ delta δ epsilon ε varepsilon ε zeta ζ eta η theta θ iota ι kappa κ lambda λ mu μ nu ν xi ξ pi π "
    "rho ρ sigma σ tau τ phi φ varphi φ chi χ psi ψ omega ω Gamma Γ Delta Δ Theta Θ Lambda Λ Sigma Σ Phi Φ Psi Ψ Omega Ω"
)
GREEK = dict(zip(LETTERS.split()[::2], LETTERS.split()[1::2], strict=True))
SHOWN = (
    "cdot=· times=× le=≤ leq=≤ ge=≥ geq=≥ ne=≠ approx=≈ infty=∞ pm=± to=→ int=∫ sum=Σ partial=∂ ldots=... dots=... quad=\n "
    "qquad=\n left= right= bigl= bigr= big= Big= displaystyle= prime=' langle=< rangle=> lVert=| rVert=| |=|"
)
SIGNS = dict(pair.split("=") for pair in SHOWN.split(" "))
"""Commands that stand for one sign; any other command, such as \\sin, is its name."""

GROUP = r"\{((?:[^{}]|\{[^{}]*\})*)\}"
FUNCTIONS = "ln|log|exp|sin|cos|tan|tanh|cosh|sinh"
TOKEN = re.compile(r"(?:\\[A-Za-z]+|[A-Za-z])(?:_\w|_\{\w+\})?(?:'|\^\*|\^\d)?|\d+(?:\.\d+)?|\|[^|]+\|")
"""One factor, which needs no parentheses in a fraction."""

SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def plain_formula(latex: str) -> str:
    """A formula in characters: fractions with a slash, Greek letters and small powers as such."""
    text = re.sub(r"\\(?:operatorname)\*?\s*" + GROUP, r" \1 ", latex)
    text = re.sub(r"\\(?:text|mathrm|mathbf|boldsymbol|mathit)\*?\s*" + GROUP, r"\1", text)
    text = re.sub(rf"(\\(?:{FUNCTIONS}))\s*(\\[dt]?frac\s*{GROUP}\s*{GROUP})", r"\1(\2)", text)
    text = re.sub(r"\\begin\{cases\}", "(", text).replace("\\end{cases}", ")").replace("\\\\", ";").replace("&", " if ")
    text = re.sub(r"\\[,;:! ]", " ", text)
    for _ in range(8):  # from the innermost braces outwards
        before = text
        text = re.sub(r"\\[dt]?frac\s*" + GROUP + r"\s*" + GROUP, lambda m: f"{_factor(m[1])}/{_factor(m[2])}", text)
        text = re.sub(r"\\[dt]?frac\s*(\w)\s*(\w)", r"\1/\2", text)
        text = re.sub(r"\\sqrt\s*\[3\]" + GROUP, r"(\1)^(1/3)", text)
        text = re.sub(r"\\sqrt\s*" + GROUP, r"√(\1)", text)
        text = re.sub(r"\\ddot\s*" + GROUP, r"\1''", text)
        text = re.sub(r"\\dot\s*" + GROUP, r"\1'", text)
        text = re.sub(r"\\(?:bar|hat|tilde|vec|overline)\s*" + GROUP, r"\1", text)
        text = re.sub(r"\^\s*" + GROUP, lambda m: _power(m[1]), text)
        text = re.sub(r"_\s*" + GROUP, r"_\1", text)
        if text == before:
            break
    text = re.sub(r"\\ddot\s*(\\?\w+)", r"\1''", text)
    text = re.sub(r"\\dot\s*(\\?\w+)", r"\1'", text)
    text = re.sub(r"\\([A-Za-z]+|\|)\s?", _sign, text)
    text = re.sub(r"\^([\d])(?!\w)", lambda m: m[1].translate(SUPERSCRIPTS), text)
    text = text.replace("{", "").replace("}", "").replace("\\", "")
    return "\n".join(filter(None, (re.sub(r"\s+", " ", line).replace("( ", "(").strip() for line in text.split("\n"))))


def _factor(part: str) -> str:
    """A part of a fraction, in parentheses if it is more than one factor."""
    part = part.strip()
    return part if TOKEN.fullmatch(part) else f"({part})"


def _power(exponent: str) -> str:
    exponent = exponent.strip()
    if re.fullmatch(r"-?\d+", exponent):
        return exponent.translate(SUPERSCRIPTS)
    return f"^{exponent}" if re.fullmatch(r"\\?\w+", exponent) else f"^({exponent})"


def _sign(match: re.Match[str]) -> str:
    name, space = match[1], match[0][len(match[1]) + 1 :]
    if name in GREEK:
        return GREEK[name] + (" " if space and match.end() < len(match.string) else "")
    if name in SIGNS:
        return SIGNS[name] + (" " if space and SIGNS[name].strip() else "")
    after = match.string[match.end() : match.end() + 1]
    return name + (" " if space or after.isalnum() or after == "\\" else "")
