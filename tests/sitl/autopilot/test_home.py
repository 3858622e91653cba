"""Home that moves in flight."""

import math

from protocol.names import Mode
from sitl.autopilot.answers import SafetyAction
from sitl.autopilot.failsafes import Failsafes
from sitl.autopilot.orders import move_home
from sitl.vehicle.aircraft import is_forward
from tests.support.flights.recorded_flight import HIGH, Flight


def test_a_return_in_forward_flight_turns_to_the_new_home():
    flight = Flight(wind_speed=3.0, wind_from=90.0, gusts=0.5)
    flight.autopilot.guided.go_to((300.0, 0.0, HIGH))
    flight.fly(12.0)
    flight.autopilot.guided.return_to_launch()
    flight.fly(8.0)
    assert is_forward(flight.vehicle)
    assert move_home(flight.autopilot, (50.0, 80.0, 0.0)).accepted
    flight.fly_until(lambda: not flight.autopilot.flying, 90.0)
    assert math.dist(flight.p[-1][:2], (50.0, 80.0)) < 0.5
    assert flight.failsafes == 0


def test_the_battery_is_compared_with_the_way_to_the_new_home_at_once():
    flight, failsafes = Flight(), Failsafes()
    autopilot = flight.autopilot
    view = flight.aircraft.view()._replace(time=0.0, battery_energy=60e3, battery_remaining=0.6)

    def alarms(view, world):
        return failsafes.check(view, Mode.HOLD, world, autopilot.settings, autopilot.chooser, landing=False)

    assert alarms(view, autopilot.world) == []
    (alarm,) = alarms(view._replace(time=1.0), autopilot.world._replace(home=(50e3, 0.0, 0.0)))
    assert alarm.action is SafetyAction.LAND
