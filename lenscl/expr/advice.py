"""What to write instead of characters, names and functions that an expression must not contain."""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Collection

from lenscl.expr.words import FUNCTIONS

_MINUS, _TIMES, _OVER = "−–—‐‑‒﹣－", "·×∙⋅∗＊⁎•", "÷∕⁄／"
_QUOTES = "'\"`´‘’‚‛“”„‟«»"
_ADVICE = {
    **dict.fromkeys(_MINUS, "write the minus sign as -"),
    **dict.fromkeys(_TIMES, "write products as *"),
    **dict.fromkeys(_OVER, "write quotients as /"),
    **dict.fromkeys(_QUOTES, "an expression has no quotation marks inside"),
    "√": "write sqrt(...)",
    "∛": "write cbrt(...)",
    "∜": "write sqrt(sqrt(...))",
    "π": "write pi",
    "°": "angles are in radians: multiply degrees by pi/180",
    "∞": "write the largest number that is meant, such as 1e9",
    "[": "group with ( and )",
    "]": "group with ( and )",
    "{": "group with ( and )",
    "}": "group with ( and )",
    "|": "write abs(...)",
    "∪": "write the union of two solids as min(F, G)",
    "∩": "write what two solids have in common as max(F, G)",
    "&": "write what two solids have in common as max(F, G)",
    "%": "write the remainder of u by v as mod(u, v)",
    "\\": "write functions by their names alone, as sqrt(x), and products as *",
    "#": "put remarks outside the expression",
    ":": "write the expression of F alone",
    ";": "write one expression; for pieces use min, max and abs",
    "?": "for pieces use min, max and abs",
    "!": "write one expression in numbers, names, ( ) , and + - * / ^",
}
_SIGNS = {"=": "=", "<": "<", ">": ">", "≤": "<", "≥": ">", "⩽": "<", "⩾": ">"}
_ALLOWED = "allowed are numbers, names, ( ) , and + - * / ^"
_WORDS = re.compile(r"\b(if|else|and|or|not|lambda)\b|&&|\|\||\?")  # of conditions
_INSIDE = "write the surface as an expression that is negative inside"

_CONSTANTS = {"pi": "pi", "tau": "2*pi", "e": "2.718281828459045"}
# Functions of other notations, written by the functions of this one
_OTHERWISE = {
    "ln": "log(u)",
    "log10": "log(u)/2.302585092994046",
    "log2": "log(u)/0.6931471805599453",
    "log1p": "log(1 + u)",
    "exp2": "pow(2, u)",
    "expm1": "exp(u) - 1",
    "fabs": "abs(u)",
    "absolute": "abs(u)",
    "square": "u^2",
    "cube": "u^3",
    "power": "pow(u, p)",
    "root": "pow(u, 1/n)",
    "rsqrt": "1/sqrt(u)",
    "maximum": "max(u, v)",
    "minimum": "min(u, v)",
    "fmax": "max(u, v)",
    "fmin": "min(u, v)",
    "union": "min(F, G)",
    "intersection": "max(F, G)",
    "difference": "max(F, -(G))",
    "clamp": "min(max(u, low), high)",
    "clip": "min(max(u, low), high)",
    "norm": "sqrt(x^2 + y^2 + z^2)",
    "length": "sqrt(x^2 + y^2 + z^2)",
    "arctan2": "atan2(y, x)",
    "arctan": "atan(u)",
    "arcsin": "asin(u)",
    "arccos": "acos(u)",
    "asinh": "log(u + sqrt(u^2 + 1))",
    "arcsinh": "log(u + sqrt(u^2 + 1))",
    "acosh": "log(u + sqrt(u^2 - 1))",
    "arccosh": "log(u + sqrt(u^2 - 1))",
    "atanh": "log((1 + u)/(1 - u))/2",
    "arctanh": "log((1 + u)/(1 - u))/2",
    "sec": "1/cos(u)",
    "csc": "1/sin(u)",
    "cot": "1/tan(u)",
    "coth": "1/tanh(u)",
    "sech": "1/cosh(u)",
    "sgn": "sign(u)",
    "signum": "sign(u)",
    "ceil": "-floor(-u)",
    "round": "floor(u + 0.5)",
    "rint": "floor(u + 0.5)",
    "trunc": "sign(u)*floor(abs(u))",
    "heaviside": "0.5 + 0.5*sign(u)",
    "step": "0.5 + 0.5*sign(u)",
    "fract": "mod(u, 1)",
    "frac": "mod(u, 1)",
    "fmod": "sign(u)*mod(abs(u), abs(v))",
    "remainder": "mod(u, v)",
    "sigmoid": "0.5 + 0.5*tanh(u/2)",
}


def shown(character: str) -> str:
    """Return a character for a message: as it is if it can be printed, and by its Unicode name if it is not ASCII."""
    if character.isascii():
        return repr(character)
    name = unicodedata.name(character, "").lower()
    code = f"U+{ord(character):04X}"
    return f"{character!r} ({name}, {code})" if name else f"{character!r} ({code})"


def for_character(text: str, column: int) -> str:
    """Return what to write instead of the character at a column, which no expression may contain."""
    found = text[column]
    if found in _SIGNS:
        pieces = "" if found == "=" else "; for pieces use min, max and abs"
        if _WORDS.search(text) or len(re.findall(r"[<>≤≥⩽⩾]", text)) > 1:
            return f"{_INSIDE}: max(F, G) where both conditions hold, min(F, G) where either does"
        return _for_relation(text, column, _SIGNS[found]) + pieces
    if found in _ADVICE:
        return _ADVICE[found].replace("...", _operand(text, column), 1)
    if found.isspace() or unicodedata.category(found) in ("Zs", "Cf"):
        return "put an ordinary space there, or nothing" if not found.isascii() else _ALLOWED
    plain = unicodedata.normalize("NFKC", found)
    if "SUPERSCRIPT" in unicodedata.name(found, ""):
        return _for_power(text, column)
    if "FRACTION" in unicodedata.name(found, ""):
        return f"write {unicodedata.numeric(found, 0.5):.15g}"
    if plain != found and plain.isascii() and plain.isprintable():
        return f"write {plain}"
    if (digit := unicodedata.decimal(found, None)) is not None:
        return f"write {digit}"
    if found.isalnum():
        return "names are of the letters a to z, digits and _; type this one anew, or write another name"
    return _ALLOWED


def _for_power(text: str, column: int) -> str:
    """Return how to write a power whose exponent is written in superscripts from a column on."""
    run = re.match(r"[\u2070-\u207f\u00b2\u00b3\u00b9]+", text[column:])
    exponent = unicodedata.normalize("NFKC", run[0] if run else "").replace("\u2212", "-")
    if not re.fullmatch(r"-?\d+", exponent):
        exponent = "n"
    before = re.search(r"[A-Za-z0-9_]+$", text[:column])
    base = before[0] if before else "(...)"
    return f"write powers as ^{exponent} or **{exponent}, here {base}^{exponent}"


def _operand(text: str, column: int) -> str:
    """Return the operand after a root sign, or after the first bar of an absolute value, at a column."""
    follows = re.match(r"([A-Za-z0-9_.]+)|\(([^()|]{1,40})\)|([^()|]{1,40})(?=\|)", text[column + 1 :])
    return "..." if follows is None else next(part for part in follows.groups() if part).strip()


def _for_relation(text: str, column: int, sign: str) -> str:
    """Return how to write an equation or an inequality."""
    left, right = text[:column].strip(" =<>!"), text[column:].lstrip(" =<>≤≥⩽⩾!").strip()
    without = f"{_INSIDE}, without {text[column]}"
    if re.fullmatch(r"[A-Za-z_]\w*\s*(\([\w\s,]*\))?", left) and sign == "=" and right not in ("0", "0.0"):
        return f"{without}: only what stands right of it" if right else without
    if not left or not right:
        return without
    if right in ("0", "0.0"):
        return f"{without}: -({_short(left)})" if sign == ">" else f"{without}: leave out what stands from there on"
    first, second = (right, left) if sign == ">" else (left, right)
    return f"{without}: {_short(first)} - ({_short(second)})"


def _short(text: str) -> str:
    return text if len(text) <= 40 else "..."


def for_function(name: str) -> str:
    """Return what to write instead of an unknown function, and the list of functions."""
    listed = f"the functions are {', '.join(sorted(FUNCTIONS))}"
    if name.lower() in FUNCTIONS:
        return f"did you mean {name.lower()!r}?"
    if name.lower() in _OTHERWISE:
        return f"write {_OTHERWISE[name.lower()]}; {listed}"
    close = difflib.get_close_matches(name[:40].lower(), sorted(FUNCTIONS), n=1)
    return f"did you mean {close[0]!r}? {listed[0].upper()}{listed[1:]}" if close else listed


def for_name(name: str, known: Collection[str], own: str = "") -> str:
    """Return what to write instead of an unknown name; `own` says where a user's own names are given."""
    if name.lower() in _CONSTANTS and name not in known:
        return f"write {_CONSTANTS[name.lower()]}"
    parts = _product(name, known)
    if parts and len(set(parts)) == 1:
        return f"did you mean {parts[0]!r}? Products are written with *, {'*'.join(parts)}"
    if parts:
        return f"write products as *, {'*'.join(parts)}"
    power = re.fullmatch(r"([A-Za-z]+)(\d+)", name)
    if power and power[1] in known:
        return f"write powers as {power[1]}^{power[2]}, products as {power[2]}*{power[1]}"
    same = [each for each in sorted(known) if each.lower() == name.lower()]
    close = same or difflib.get_close_matches(name[:40], sorted(known), n=1)
    hint = f"did you mean {close[0]!r}?" if close else f"known are {', '.join(sorted(known))}"
    if not own or same:
        return hint
    return f"{hint}{' A' if close else '; a'} number of your own is given {own}: {name} = ..."


def _product(name: str, known: Collection[str]) -> list[str]:
    """Return the known one-letter names that a name is a product of, as in xy; an empty list if it is none."""
    singles = [each for each in name if each in known]
    return singles if 1 < len(name) == len(singles) <= 8 else []


def for_module(text: str, column: int) -> str:
    """Return what to write instead of a name after a point, at the point's column."""
    before = re.search(r"[A-Za-z_]\w*$", text[:column])
    after = re.match(r"[A-Za-z_]\w*", text[column + 1 :])
    if before is not None and after is not None:
        module, name = before[0], after[0]
        if name in FUNCTIONS:
            return f"write {name}(...) without {module} before it"
        if name.lower() in _OTHERWISE and text[column + 1 + after.end() :].lstrip().startswith("("):
            return f"write {_OTHERWISE[name.lower()]}, without {module} before it"
        if name.lower() in _CONSTANTS and module.lower() in ("math", "np", "numpy", "cmath", "m"):
            return f"write {_CONSTANTS[name.lower()]} for {module}.{name}"
    return ""


def for_missing_operator(text: str, start: int, end: int) -> str:
    """Return how to write two parts of an expression between which an operator is missing.

    Parameters
    ----------
    text : str
    start, end : int
        The columns of the first character of the second part, and behind its last.
    """
    powered = re.search(r"([A-Za-z]\w*)\s*(?:\^|\*\*)\s*(\d+)\s*$", text[:start])
    if powered is not None and powered[1] in FUNCTIONS:
        return f"write {powered[1]}(...)^{powered[2]}"
    before = re.search(r"[A-Za-z0-9_.]+$", text[:start].rstrip())
    first, second = before[0] if before else "(...)", text[start:end]
    if first in FUNCTIONS:
        return f"an operand stands in brackets: {first}({second})"
    second = f"{second}(...)" if second in FUNCTIONS else "(...)" if second == "(" else second
    return f"write products as *, {first}*{second}"


def decimal_comma(text: str) -> int | None:
    """Return the place of the first comma between two digits, as in 0,5; None if there is none."""
    found = re.search(r"(?<![\w.])\d+(,)\d+(?![\w.])", text)
    return None if found is None else found.start(1)
