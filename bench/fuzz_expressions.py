"""Make texts of expressions: solids that often have an inside, any of the grammar, damaged and long ones."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

from lenscl.expr import FUNCTIONS
from lenscl.expr.words import operands_of

NAMES = ("x", "y", "z", "k", "R", "a_1")  # the symbols of the expressions that are made
_LONGEST = 30_000  # characters of a repeated piece
_EXPRESSIONS = (
    "x**2 + y**2 + z**2 - k",
    "x**4 + y**4 + z**4 - k",
    "max(x^2 + y^2 + z^2 - R, k - x)",
    "(hypot(x, y) - R)^2 + z^2 - k^2",
    "min(sqrt(x*x + y*y) - k, abs(z) - R)",
    "exp(x) + cos(y) * z - k",
)
_PIECES = (  # what stands once before a piece, the piece, what follows it once, and what closes each piece
    *(("", "(", "x", ")"), ("", "sin(", "x", ")"), ("", "x^", "2", ""), ("", "-", "x", ""), ("x", " + y*z", "", "")),
    *(("x", " - sin(x + y)", "", ""), ("", "min(x, ", "y", ")"), ("", "x*-", "y", ""), ("max(x", ", y + z", "", ")")),
    *(("x", "/y", "", ""), ("x", " ", "", ""), ("", "2^", "2", ""), ("x", "*x*y", "", ""), ("", "(x+1)*", "z", "")),
)
_SIGNS = (
    *("(", ")", ",", "+", "-", "*", "/", "^", "**", ".", "=", "<", "²", "×", "[", ";", "'", "\\", "\0", " ", "\n"),
    *("//", "%"),
)
_WORDS_OF_PYTHON = ("if", "lambda", "True", "_", "x.y", "\ud800")
PART = re.compile(r"[A-Za-z_]\w*|\d+\.?\d*(?:e[+-]?\d+)?|\*\*|\s+|.", re.DOTALL)


class Expressions:
    """Makes expressions from a source of random numbers."""

    def __init__(self, rng: random.Random) -> None:
        self.rng = rng

    def expression(self) -> str:
        """Return the text of an expression, whole in two of three cases."""
        way = self.rng.random()
        if way < 0.5:
            return self._solid()
        if way < 0.67:
            return self._tree(self._size())
        if way < 0.97:
            return self._damaged(self._solid(), PART, self._part)
        if way < 0.985:
            return "".join(self.rng.choices("xyzkR0129.()+-*/^, esqrtminax_\n\té²", k=self.rng.randint(0, 60)))
        return self._repeated()

    def _size(self) -> int:
        return min(1 + int(self.rng.expovariate(1 / 6)), 60)

    def _solid(self) -> str:
        """Return an expression that often has an inside within the box: one of some, with more put to it."""
        rng = self.rng
        text = rng.choice(_EXPRESSIONS)
        for _ in range(rng.randint(0, 2)):
            more = self._tree(self._size())
            text = rng.choice(
                (f"{text} + {more}", f"max({text}, {more})", f"({text}) * ({more})", f"min({text}, {more}, z - 0.5)",
                 f"{text} - 0.1*sin({more})", f"({text}) / (1 + ({more})^2)")
            )  # fmt: skip
        return f"max({text}, x^2 + y^2 + z^2 - 3)" if rng.random() < 0.5 else text

    def _tree(self, size: int) -> str:
        """Return an expression of about so many leaves."""
        rng = self.rng
        if size <= 1:
            return rng.choice(NAMES) if rng.random() < 0.7 else self._number()
        match rng.choices(("binary", "power", "call", "sign", "brackets"), (50, 14, 26, 6, 4))[0]:
            case "binary":
                left = rng.randint(1, size - 1)
                return f"{self._operand(left)} {rng.choice('+-*/')} {self._operand(size - left)}"
            case "power":
                exponent = rng.choice(("2", "3", "4", "8", "-1", "0", "64", "65", "0.5", "1.5", "(1/3)", "k", "-x"))
                return f"({self._tree(size - 1)}){rng.choice(('^', '**'))}{exponent}"
            case "call":
                name = rng.choice(sorted(FUNCTIONS))
                count = operands_of(name) if name not in ("min", "max") else rng.randint(2, 4)
                return f"{name}({', '.join(self._tree(max(size // count, 1)) for _ in range(count))})"
            case "sign":
                return f"{rng.choice('-+')}{self._operand(size)}"
            case _:
                return f"({self._tree(size)})"

    def _operand(self, size: int) -> str:
        text = self._tree(size)
        return text if self.rng.random() < 0.5 else f"({text})"

    def _number(self) -> str:
        rng = self.rng
        if rng.random() < 0.7:
            return rng.choice(("0", "1", "2", "0.5", "3", "1e-3", "7."))
        if rng.random() < 0.5:
            return f"{rng.random() * 10.0 ** rng.randint(-320, 308):.{rng.randint(1, 17)}g}"
        return rng.choice(("1e308", "1e-320", "1e999", ".5", "1e", "0x1", "1_0", "00", "1e+5", "9" * 400))

    def _repeated(self) -> str:
        """Return a long or deep text of one piece."""
        count = int(10 ** self.rng.uniform(1.0, 4.0))
        before, piece, middle, after = self.rng.choice(_PIECES)
        count = min(count, _LONGEST // len(piece))
        end = after * (count if before == "" else 1)
        return before + piece * count + middle + end

    def _damaged(self, text: str, token: re.Pattern[str], another: Callable[[], str]) -> str:
        """Return a text with some of its parts removed, doubled, exchanged or replaced."""
        rng = self.rng
        parts = token.findall(text)
        for _ in range(rng.randint(1, 4)):
            place = rng.randrange(len(parts) + 1)
            match rng.randrange(6):
                case 0:
                    del parts[place : place + rng.randint(1, 3)]
                case 1:
                    parts[place:place] = parts[place : place + rng.randint(1, 6)] * rng.randint(1, 3)
                case 2 if len(parts) > 1:
                    one, two = rng.sample(range(len(parts)), 2)
                    parts[one], parts[two] = parts[two], parts[one]
                case 3 if parts:
                    start, end = sorted(rng.choices(range(len(parts)), k=2))
                    parts[place:place] = parts[start : min(end, start + 60)]
                case 4:
                    parts[place : place + 1] = [another()]
                case _:
                    parts.insert(place, another())
        return "".join(parts)

    def _part(self) -> str:
        rng = self.rng
        some = (rng.choice(_SIGNS), rng.choice(NAMES), rng.choice(sorted(FUNCTIONS)), self._number())
        return rng.choice((*some, *_WORDS_OF_PYTHON))
