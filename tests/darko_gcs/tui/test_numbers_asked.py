"""Every number that a dialog asks for is checked as it is entered, in the operator's words."""

import pytest
from textual.widgets import Input, Static

from darko_gcs.state.fence_edits import CIRCLE_IN, RALLY, limit_item
from darko_gcs.state.parameters import ParameterMetadata
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.screens.dialogs import AskScreen
from protocol.dialect import mavlink
from sitl.defaults import HOME
from tests.support.gcs.screens import FakeFeed, screen_text, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with

ON_GROUND = snapshot_with(HOVERING, status={"landed_state": mavlink.MAV_LANDED_STATE_ON_GROUND, "armed": False})
ORIGIN = (0.0, 0.0, 0.0)
CIRCLE = limit_item(CIRCLE_IN, (10.0, 0.0), 20.0, 0.0, HOME, ORIGIN)
POINT = limit_item(RALLY, (10.0, 0.0), 0.0, 20.0, HOME, ORIGIN)
BAD = ("1e39", "-1e39", "nan", "1e12", "", "text")
INTERNALS = ("MissionItem", "Error", "wire", "param", "encode", "COMMAND_", "does not fit", "e+33")
DIALOGS = {  # name: snapshot, keys that open it, fields that are numbers
    "take off": (ON_GROUND, "t", (0,)),
    "go to": (HOVERING, "g", (0, 1, 2)),
    "speed": (HOVERING, "c", (0,)),
    "low legs": (HOVERING, "mL", (0,)),
    "item": (HOVERING, "me", range(2, 8)),
    "fence": (HOVERING, "mFe", (0, 1, 2)),
    "rally point": (HOVERING, "mFFe", (0, 1, 2)),
    "parameter": (HOVERING, "p", (0,)),
}
ALSO_ALLOWED = {"parameter": {"1e12"}}  # by the vehicle's own metadata: it has none here


@pytest.mark.long
@pytest.mark.parametrize("name", DIALOGS)
async def test_what_cannot_be_flown_or_sent_is_refused_in_the_operators_words(name):
    s, keys, numbers = DIALOGS[name]
    s = snapshot_with(s, parameters={"values": {"DRK_KPP": 1.0}, "metadata": {"DRK_KPP": ParameterMetadata()}})
    feed = FakeFeed(s)
    app = GroundStationApp(feed)
    app.draft.fence, app.draft.rally = (CIRCLE,), (POINT,)
    app.draft.changed, app.draft.plan = True, app.draft.plan.with_items(s.plans.mission)
    async with app.run_test(size=(120, 40)) as pilot:
        for key in keys:
            await pilot.press(key)
            await pilot.pause()
        if name == "parameter":
            await until(pilot, lambda: "DRK_KPP" in screen_text(app))
            await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, AskScreen) and isinstance(app.focused, Input))
        asked, feed.requests[:] = app.screen, []
        fields = list(asked.query(Input))
        assert len(fields) >= len(numbers)
        for number in (number for number in numbers if number < len(fields)):
            kept = fields[number].value
            for text in BAD:
                if text in ALSO_ALLOWED.get(name, ()):
                    continue
                fields[number].value = text
                await pilot.press("enter")
                await pilot.pause()
                told = str(asked.query_one("#problem", Static).content)
                assert app.screen is asked, text
                assert told, text
                assert not [word for word in INTERNALS if word in told], told
                asked.query_one("#problem", Static).update("")
            fields[number].value = kept
    assert feed.requests == []
    assert app.draft.plan.items == s.plans.mission
    assert (app.draft.fence, app.draft.rally) == ((CIRCLE,), (POINT,))


OTHER_FORMS = {
    "survey": (HOVERING, "mN"),
    "heights": (HOVERING, "mR"),
    "chart": (HOVERING, "Ca"),
    "view": (HOVERING, "Cs"),
}


@pytest.mark.long(after=3)
@pytest.mark.parametrize("name", [*OTHER_FORMS, *DIALOGS])
async def test_every_form_explains_the_field_that_is_filled_in(name):
    s, keys = (OTHER_FORMS.get(name) or DIALOGS[name])[:2]
    s = snapshot_with(s, parameters={"values": {"DRK_KPP": 1.0}, "metadata": {"DRK_KPP": ParameterMetadata()}})
    app = GroundStationApp(FakeFeed(s))
    app.draft.fence, app.draft.rally = (CIRCLE,), (POINT,)
    app.draft.changed, app.draft.plan = True, app.draft.plan.with_items(s.plans.mission)
    async with app.run_test(size=(80, 24)) as pilot:
        for key in keys:
            await pilot.press(key)
            await pilot.pause()
        if name == "parameter":
            await until(pilot, lambda: "DRK_KPP" in screen_text(app))
            await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, AskScreen) and isinstance(app.focused, Input))
        form = app.screen
        for field, asked in zip(form.query(Input), form._fields, strict=True):
            field.focus()
            assert 0 < len(asked.help) <= 58
            await until(pilot, lambda asked=asked: asked.help in screen_text(app))
