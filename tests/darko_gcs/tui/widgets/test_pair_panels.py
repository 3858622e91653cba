"""Two recordings side by side."""

import pytest

from darko_gcs.tui.widgets.pair_panels import distinct_names


@pytest.mark.parametrize(
    ("names", "width", "shown"),
    [
        (["a.tlog", "b.tlog"], 12, ["a.tlog", "b.tlog"]),
        (["20261123-025322.tlog", "20261123-031510.tlog"], 10, ["…23-025322", "…23-031510"]),
        (["20261123-025322.tlog", "20261123-031510.tlog"], 5, ["…2532", "…3151"]),
        (["20261123-025322.tlog", "20261123-025322-2.tlog"], 6, ["…322", "…322-2"]),
        (["same.tlog", "same.tlog"], 4, ["same", "same"]),
    ],
)
def test_names_that_begin_alike_are_told_apart_by_what_differs(names, width, shown):
    assert distinct_names(names, width) == shown
