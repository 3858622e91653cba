"""Parameters and plans as single files: MAVProxy reads back what was packed."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.engines.parameter_values import Parameter
from protocol.plans import load
from protocol.plans.mission_item import MissionItem
from sitl.mavlink.ftp_files import default_values, pack_parameters, pack_plan
from sitl.simulation.tuning import Tuning
from sitl.vehicle.parameters import Configuration
from tests.support.paths import DATA
from tests.support.vehicle.file_session import FileSession

TABLE_NOW = Configuration().wire_table()
SQUARE = load(DATA / "square.plan").items


def decoder():
    return pytest.importorskip("MAVProxy.modules.lib.param_ftp").ftp_param_decode


def test_mavproxy_reads_the_parameters(tmp_path):
    decoded = decoder()(FileSession(tmp_path).read("@PARAM/param.pck").data)
    told = {name.decode(): value for name, value, _ in decoded.params}
    assert told == {p.name: pytest.approx(p.value, rel=1e-6) for p in TABLE_NOW}
    assert decoded.defaults is None


def test_mavproxy_reads_defaults_beside_changed_values():
    changed = Configuration(tuning=Tuning(kpp=2.0, integral=0)).wire_table()
    decoded = decoder()(pack_parameters(changed, default_values()))
    values, defaults = ({name.decode(): v for name, v, _ in table} for table in (decoded.params, decoded.defaults))
    assert (values["DRK_KPP"], defaults["DRK_KPP"]) == (2.0, 1.5)
    assert (values["DRK_LQI"], defaults["DRK_LQI"]) == (0, 1)
    assert {n for n in values if values[n] != defaults[n]} == {"DRK_KPP", "DRK_LQI"}


def test_parts_of_the_parameters_join():
    whole = pack_parameters(TABLE_NOW)
    parts = [pack_parameters(TABLE_NOW, start=n, count=10) for n in range(0, len(TABLE_NOW), 10)]
    assert struct.unpack_from("<HHH", whole) == (0x671B, len(TABLE_NOW), len(TABLE_NOW))
    assert sum(struct.unpack_from("<HHH", part)[1] for part in parts) == len(TABLE_NOW)


@given(st.lists(st.from_regex(r"[A-Z0-9_]{1,16}", fullmatch=True), unique=True, min_size=1, max_size=40))
def test_any_names_survive_the_packing(names):
    kind = mavlink.MAV_PARAM_TYPE_INT32
    table = [Parameter(name=name, type=kind, value=n) for n, name in enumerate(names)]
    decoded = decoder()(pack_parameters(table))
    assert {name.decode(): value for name, value, _ in decoded.params} == {p.name: p.value for p in table}


def test_a_plan_in_a_file_is_the_plan():
    data = pack_plan(SQUARE, 0)
    kind = mavlink.MAVLink_mission_item_int_message
    assert struct.unpack_from("<HHHHH", data) == (0x763D, 0, 0, 0, len(SQUARE))
    for seq, item in enumerate(SQUARE):
        fields = kind.unpacker.unpack_from(data, 10 + seq * kind.unpacker.size)
        message = kind(*(fields[kind.orders[at]] for at in range(len(fields))))
        assert (message.seq, message.mission_type, MissionItem.from_message(message)) == (seq, 0, item)
