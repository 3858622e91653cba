import json
import math

from protocol.tools.command_line import json_values


def test_what_json_does_not_have_is_null_at_any_depth():
    value = {"a": math.nan, "b": [1, (math.inf, -math.inf, 2.5)], 3: {"c": "nan", "d": None}, "e": True}
    given = json_values(value)
    assert given == {"a": None, "b": [1, [None, None, 2.5]], 3: {"c": "nan", "d": None}, "e": True}
    json.dumps(given, allow_nan=False)
