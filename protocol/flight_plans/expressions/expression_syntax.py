"""Reads expressions: C's operators and precedence, the @-words that XML makes necessary, and ** for powers."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, Final

from lark import Lark, ParseTree, Token, Transformer, UnexpectedInput, UnexpectedToken, v_args
from lark.exceptions import VisitError

from protocol.flight_plans.expressions.expression_tree import (
    MAX_WHOLE_NUMBER,
    ArrayItem,
    BlockTitle,
    Call,
    Expression,
    Instruction,
    LoopVariable,
    Member,
    Negation,
    Number,
    Operation,
    Reference,
    Script,
    StoredIn,
    Target,
    Tree,
    VariableName,
)
from protocol.flight_plans.place import FlightPlanError, SourceText

__all__ = [
    "MAX_EXPRESSION_DEPTH",
    "MAX_EXPRESSION_LENGTH",
    "PRECEDENCE",
    "WORDS",
    "parse_expression",
    "parse_script",
    "parse_target",
]

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
