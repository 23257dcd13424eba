"""Classes of equals in diagnosis.json: tables as the contract has them, sets beside them."""

import pytest

from corexy_fmi.engine.telling.classes import between, equals, sets

A, B, C, D = (("backlash", "motor1"), ("sensor_delay", "sensor"), ("sensor_lag", "sensor"),
              ("tool_mode", "tool"))  # fmt: skip


def table(*pairs):
    return [{"name": name, "location": location} for name, location in pairs]


@pytest.mark.parametrize(
    ("group", "told"),
    [
        (((B,), (C,)), table(B, C)),
        (((A, B), (A, C)), table(B, C)),
        (((A,), (A, B)), table(A, B)),
        (((A, B), (C, D)), table(A, B, C, D)),
        (((B,), ()), table(B)),
    ],
)
def test_members_are_tables(group, told):
    assert between([group]) == [told]


def test_sets_are_told_where_effects_act_together():
    assert sets([((A, B), (A, C)), ((D,), ())]) == [[table(A, B), table(A, C)], [table(D)]]
    assert sets([((B,), (C,))]) == []


def test_what_a_document_tells_are_lists_of_what_acts_together():
    classes = [((A, B), (A, C))]
    document = {"ambiguous_between": between(classes), "ambiguous_sets": sets(classes)}
    assert equals(document) == [[table(A, B), table(A, C)]]
    assert equals({"ambiguous_between": between([((B,), (C,))])}) == [[table(B), table(C)]]
    assert equals({}) == []
