"""The battery: its share, voltage and current as energy is drawn."""

import pytest

from sitl.model.battery import Battery


@pytest.mark.parametrize(
    ("used", "left", "voltage"),
    [(0.0, 1.0, 12.6), (250.0, 0.75, 11.925), (500.0, 0.5, 11.25), (1000.0, 0.0, 9.9), (2000.0, 0.0, 9.9)],
)
def test_share_and_voltage_fall_linearly_from_full_to_empty_and_no_further(used, left, voltage):
    battery = Battery(capacity=1000.0, used=used)
    assert battery.remaining == pytest.approx(left)
    assert battery.voltage() == pytest.approx(voltage)


def test_the_current_is_the_power_over_the_voltage():
    assert Battery(1000.0, 0.0).current(126.0) == pytest.approx(10.0)
    assert Battery(1000.0, 1000.0).current(126.0) == pytest.approx(126.0 / 9.9)
    assert Battery(1000.0, 0.0).current(0.0) == 0.0


def test_the_voltage_sags_with_the_current_over_the_cells():
    battery = Battery(1000.0, 0.0, resistance=0.03)
    assert battery.voltage(126.0) == pytest.approx(12.6 - 0.3)
    assert battery.voltage() == pytest.approx(12.6)
