"""Expressions of flight plans: trees, read with C's operators and precedence, and written without < and &.

Trees are equal if they mean the same, wherever they stand.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Final, TypeAlias

from lark import Lark, ParseTree, Token, Transformer, UnexpectedInput, UnexpectedToken, v_args
from lark.exceptions import VisitError

from protocol.flight_plans.xml_elements import NOWHERE, FlightPlanError, Place, SourceText

MAX_WHOLE_NUMBER = 2**63 - 1


@dataclass(frozen=True, slots=True)
class Number:
    """A number; without a point or an exponent it is whole, as in C."""

    value: int | float
    place: Place = NOWHERE

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Number) and type(self.value) is type(other.value) and self.value == other.value

    def __hash__(self) -> int:
        return hash((type(self.value), self.value))


@dataclass(frozen=True, slots=True)
class BlockTitle:
    """A quoted text: the name of a block."""

    text: str
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class VariableName:
    """A variable or constant by its name; ``nav.radius`` is one name."""

    name: str
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Reference:
    """``&name``: a variable that a function changes."""

    name: str
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class LoopVariable:
    """``$name``: the counter of a loop around."""

    name: str
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Negation:
    """``-x`` or ``!x``."""

    operator: str
    operand: Tree
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Operation:
    """Two operands and an operator: one of ``PRECEDENCE``."""

    operator: str
    left: Tree
    right: Tree
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class ArrayItem:
    """``name[index]`` or a field of it, ``name[index].field``: here only waypoints are an array."""

    name: str
    index: Tree
    member: str = ""  # the field, with points between the parts of its name
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Call:
    """A function called with arguments."""

    name: str
    arguments: tuple[Tree, ...]
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Member:
    """A field of what a call gives: ``stateGetPositionEnu_f()->z``."""

    call: Call
    name: str
    place: Place = field(default=NOWHERE, compare=False)


Tree: TypeAlias = (
    Number | BlockTitle | VariableName | Reference | LoopVariable | Negation | Operation | ArrayItem | Call | Member
)


Target: TypeAlias = VariableName | ArrayItem | Call  # C's lvalues; of calls those that are macros for one


@dataclass(frozen=True, slots=True)
class Expression:
    """An expression of a plan; ``text`` is how it was written."""

    tree: Tree
    text: str = field(default="", compare=False)
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class StoredIn:
    """Target in which a stage stores a value; ``text`` is the source text."""

    tree: Target
    text: str = field(default="", compare=False)
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Instruction:
    """One statement: ``expression;``, ``name = expression;`` or either after ``if (condition)``."""

    expression: Tree
    target: Target | None = None  # what the value is stored in
    condition: Tree | None = None
    place: Place = field(default=NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class Script:
    """Call of one function, or of several statements one after the other."""

    instructions: tuple[Instruction, ...]
    text: str = field(default="", compare=False)
    place: Place = field(default=NOWHERE, compare=False)


def walk(tree: Tree) -> Iterator[Tree]:
    """All parts of a tree, itself first."""
    waiting = [tree]
    while waiting:
        part = waiting.pop()
        yield part
        match part:
            case Negation():
                waiting.append(part.operand)
            case Operation():
                waiting += [part.right, part.left]
            case ArrayItem():
                waiting.append(part.index)
            case Call():
                waiting += reversed(part.arguments)
            case Member():
                waiting.append(part.call)
            case _:
                pass


_UNARY, _ATOM = 9, 11  # precedence of -x and !x, and of what needs no parentheses


def expression_text(tree: Tree) -> str:
    """A tree as text that is read to the same tree."""
    return _text(tree)[0]


def script_text(script: Script) -> str:
    """Statements as text that is read to the same statements."""
    return "; ".join(map(_instruction, script.instructions))


def _instruction(instruction: Instruction) -> str:
    text = expression_text(instruction.expression)
    if instruction.target is not None:
        text = f"{expression_text(instruction.target)} = {text}"
    return text if instruction.condition is None else f"if ({expression_text(instruction.condition)}) {text}"


def _text(tree: Tree) -> tuple[str, int]:
    """The text of a tree, and the precedence of what stands outermost in it."""
    match tree:
        case Number() | BlockTitle() | VariableName() | LoopVariable():
            return _atom(tree), _ATOM
        case Reference():
            return f"&{tree.name}", _UNARY
        case ArrayItem():
            member = f".{tree.member}" if tree.member else ""
            return f"{tree.name}[{expression_text(tree.index)}]{member}", _ATOM
        case Call():
            return f"{tree.name}({', '.join(map(expression_text, tree.arguments))})", _ATOM
        case Member():
            return f"{expression_text(tree.call)}->{tree.name}", _ATOM
        case Negation():
            return tree.operator + _within(tree.operand, _UNARY), _UNARY
        case Operation():
            return _operation(tree)


def _atom(tree: Number | BlockTitle | VariableName | LoopVariable) -> str:
    match tree:
        case Number():
            return repr(tree.value)
        case BlockTitle():
            return f"'{tree.text}'" if "'" not in tree.text else f'"{tree.text}"'
        case LoopVariable():
            return f"${tree.name}"
        case _:
            return tree.name


def _operation(tree: Operation) -> tuple[str, int]:
    rank = PRECEDENCE[tree.operator]
    if tree.operator == "**":
        left, right = _within(tree.left, _ATOM), _within(tree.right, _UNARY)
    else:
        left, right = _within(tree.left, rank), _within(tree.right, rank + 1)
    return f"{left} {_WORD_OF_SIGN.get(tree.operator, tree.operator)} {right}", rank


def _within(tree: Tree, least: int) -> str:
    """The text of a part, in parentheses if it binds less tightly than ``least``."""
    text, rank = _text(tree)
    return text if rank >= least else f"({text})"


MAX_EXPRESSION_LENGTH = 4000  # [characters]
MAX_EXPRESSION_DEPTH = 100  # of parts in each other

PRECEDENCE: Final = {  # the higher, the tighter; all but ** group to the left
    "||": 1,
    "&&": 2,
    "|": 3,
    "&": 4,
    "==": 5,
    "!=": 5,
    ">": 6,
    "<": 6,
    ">=": 6,
    "<=": 6,
    "+": 7,
    "-": 7,
    "*": 8,
    "/": 8,
    "%": 8,
    "**": 10,
}
WORDS: Final = {"@OR": "||", "@AND": "&&", "@GT": ">", "@LT": "<", "@GEQ": ">=", "@LEQ": "<=", "@EQ": "=="}
_WORD_OF_SIGN: Final = {sign: word for word, sign in WORDS.items() if sign != "=="}

_GRAMMAR = r"""
script: instruction (";" instruction)* ";"*
?instruction: plain | "if" "(" disjunction ")" plain -> conditional
?plain: disjunction -> evaluated
      | target "=" disjunction -> assigned
?target: path -> variable | item | call
?expression: disjunction
?disjunction: conjunction | disjunction OR conjunction -> operation
?conjunction: bits_or | conjunction AND bits_or -> operation
?bits_or: bits_and | bits_or BIT_OR bits_and -> operation
?bits_and: equality | bits_and BIT_AND equality -> operation
?equality: comparison | equality EQUALITY comparison -> operation
?comparison: sum | comparison COMPARISON sum -> operation
?sum: product | sum (PLUS | MINUS) product -> operation
?product: unary | product (TIMES | OVER) unary -> operation
?unary: power | (MINUS | PLUS | NOT) unary -> negation | BIT_AND path -> reference
?power: atom | atom POWER unary -> operation
?atom: NUMBER -> number
     | QUOTED -> quoted
     | "$" NAME -> loop_variable
     | path -> variable
     | item
     | call
     | call (_ARROW | ".") NAME -> member
     | "(" disjunction ")"
call: NAME "(" [disjunction ("," disjunction)*] ")"
item: path "[" disjunction "]" ((_ARROW | ".") NAME)*
path: NAME ((_ARROW | ".") NAME)*

OR: "||" | "@OR"
AND: "&&" | "@AND"
BIT_OR: "|"
BIT_AND: "&"
EQUALITY: "==" | "!=" | "@EQ"
COMPARISON: ">=" | "<=" | ">" | "<" | "@GEQ" | "@LEQ" | "@GT" | "@LT"
PLUS: "+"
MINUS: "-"
TIMES: "*"
OVER: "/" | "%"
NOT: "!"
POWER: "**"
_ARROW: "->" | "@DEREF"
QUOTED: /'[^']*'|"[^"]*"/
NUMBER.2: /0[xX][0-9A-Fa-f]+[uUlL]*|([0-9]+\.[0-9]*|\.[0-9]+|[0-9]+)([eE][+-]?[0-9]+)?[fFuUlL]*(?![A-Za-z_0-9])/
NAME: /[A-Za-z_][A-Za-z0-9_]*/
%import common.WS
%ignore WS
"""


def parse_expression(source: SourceText) -> Expression:
    """The expression that an attribute holds.

    Raises:
        FlightPlanError: It is none; the place is that of the character where the fault shows.
    """
    tree: Tree = _parsed("expression", source)
    return Expression(tree, source.text, source.place)


def parse_script(source: SourceText) -> Script:
    """The call or statements that an attribute holds.

    Raises:
        FlightPlanError: It is none.
    """
    instructions: tuple[Instruction, ...] = _parsed("script", source)
    return Script(instructions, source.text, source.place)


def parse_target(source: SourceText) -> StoredIn:
    """Parse an attribute that names the target of an assignment: a variable, or a waypoint's coordinate.

    Raises:
        FlightPlanError: It is none.
    """
    tree: Target = _parsed("target", source)
    return StoredIn(tree, source.text, source.place)


@cache
def _parsers() -> Lark:
    return Lark(
        _GRAMMAR, parser="lalr", start=["expression", "script", "target"], lexer="contextual", propagate_positions=False
    )


def _parsed(start: str, source: SourceText) -> Any:  # noqa: ANN401 - what the rule makes
    if len(source.text) > MAX_EXPRESSION_LENGTH:
        raise FlightPlanError(source.place, f"expression longer than {MAX_EXPRESSION_LENGTH} characters")
    try:
        parsed = _parsers().parse(source.text, start=start)
    except UnexpectedInput as error:
        raise _refusal(source, error) from None
    _check_depth(parsed, source)
    try:
        return _TreeMaker(source).transform(parsed)
    except VisitError as error:
        raise error.orig_exc from None


def _refusal(source: SourceText, error: UnexpectedInput) -> FlightPlanError:
    index = error.pos_in_stream
    if index is None or (isinstance(error, UnexpectedToken) and error.token.type == "$END"):
        return FlightPlanError(source.at(len(source.text)), f"{_short(source.text)} ends too early")
    return FlightPlanError(source.at(index), f"{_short(source.text[index:])} is not expected here in an expression")


def _short(text: str) -> str:
    return repr(text if len(text) <= 30 else text[:27] + "...")


def _check_depth(parsed: ParseTree, source: SourceText) -> None:
    waiting = [(parsed, 1)]
    while waiting:
        part, depth = waiting.pop()
        if depth > MAX_EXPRESSION_DEPTH:
            raise FlightPlanError(source.place, f"expression nested more than {MAX_EXPRESSION_DEPTH} levels deep")
        waiting += [(child, depth + 1) for child in getattr(part, "children", ())]


@v_args(inline=True)
class _TreeMaker(Transformer[Token, Any]):
    """Makes our trees of the parser's."""

    def __init__(self, source: SourceText) -> None:
        super().__init__()
        self._source = source

    def number(self, token: Token) -> Number:
        place = self._source.at(token.start_pos or 0)
        text = token.lower()
        if text.startswith("0x"):
            value: int | float = int(text.rstrip("ul"), 16)
        else:
            text = text.rstrip("ful")
            value = int(text) if text.isdecimal() else float(text)
            value = float(value) if token[-1] in "fF" else value
        if not math.isfinite(value) or (isinstance(value, int) and value > MAX_WHOLE_NUMBER):
            raise FlightPlanError(place, f"number {_short(str(token))} is too large")
        return Number(value, place)

    def quoted(self, token: Token) -> BlockTitle:
        return BlockTitle(str(token)[1:-1], self._source.at(token.start_pos or 0))

    def path(self, *names: Token) -> VariableName:
        return VariableName(".".join(names), self._source.at(names[0].start_pos or 0))

    def variable(self, name: VariableName) -> VariableName:
        return name

    def loop_variable(self, name: Token) -> LoopVariable:
        return LoopVariable(str(name), self._source.at((name.start_pos or 1) - 1))

    def item(self, name: VariableName, index: Tree, *members: Token) -> ArrayItem:
        return ArrayItem(name.name, index, ".".join(members), name.place)

    def call(self, name: Token, *arguments: Tree | None) -> Call:
        given = tuple(argument for argument in arguments if argument is not None)
        return Call(str(name), given, self._source.at(name.start_pos or 0))

    def member(self, call: Call, name: Token) -> Member:
        return Member(call, str(name), call.place)

    def negation(self, sign: Token, operand: Tree) -> Tree:
        return operand if sign == "+" else Negation(str(sign), operand, self._source.at(sign.start_pos or 0))

    def reference(self, sign: Token, name: VariableName) -> Reference:
        return Reference(name.name, self._source.at(sign.start_pos or 0))

    def operation(self, left: Tree, sign: Token, right: Tree) -> Operation:
        return Operation(WORDS.get(sign, str(sign)), left, right, self._source.at(sign.start_pos or 0))

    def evaluated(self, tree: Tree) -> Instruction:
        return Instruction(tree, place=tree.place)

    def assigned(self, target: Target, tree: Tree) -> Instruction:
        return Instruction(tree, target, place=target.place)

    def conditional(self, condition: Tree, plain: Instruction) -> Instruction:
        return Instruction(plain.expression, plain.target, condition, condition.place)

    def script(self, *instructions: Instruction) -> tuple[Instruction, ...]:
        return instructions
