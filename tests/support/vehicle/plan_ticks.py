"""A flight plan ticked by hand: the vehicle is where a test says, and no time passes but what it asks for."""

import math
from typing import Any

from protocol.flight_plans.flight_plan import EnuPoint
from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.plan_names import NameMapping
from protocol.frames import Geodetic, LocalFrame
from sitl.autopilot.flight_plan.aims import AimKind, BlockEntered, ExceptionFired, PlanRemark
from sitl.autopilot.flight_plan.executor import PLAN_TICK, FlightPlanExecutor
from sitl.autopilot.flight_plan.plan_state import PlanInputs
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.guidance.view import VehicleView
from tests.support.plans import plan_of

WORLD = World(LocalFrame(Geodetic(43.5641, 1.4829, 100.0)), ARENAS["open"])


def view_at(time, p=(0.0, 0.0, 0.0), v=(0.0, 0.0, 0.0), **told):
    """A vehicle at a point east, north and up."""
    north_west_up = (p[1], -p[0], p[2])
    velocity = (v[1], -v[0], v[2])
    told = {"heading": 0.0, "tilt": 0.0, "landed": p[2] <= 0.2, "battery_remaining": 1.0} | told
    return VehicleView(time=time, p=north_west_up, v=velocity, **told)


def moved(aim, p, step):
    """A point one step on its way to an aim [m]: along a leg, about a centre, or up and down."""
    x, y, z = p
    z += (aim.climb or 0.0) * PLAN_TICK if aim.climb is not None else max(-step, min(step, aim.end.z - z))
    if aim.kind is AimKind.ARC:
        size = math.copysign(max(math.hypot(x - aim.end.x, y - aim.end.y), 1e-3), aim.radius)
        bearing = math.atan2(x - aim.end.x, y - aim.end.y) + step / size
        size = abs(size) + max(-step, min(step, abs(aim.radius) - abs(size)))
        return aim.end.x + size * math.sin(bearing), aim.end.y + size * math.cos(bearing), max(z, 0.0)
    left = math.hypot(aim.end.x - x, aim.end.y - y)
    share = min(step / left, 1.0) if left > 0.0 else 0.0
    return x + share * (aim.end.x - x), y + share * (aim.end.y - y), max(z, 0.0)


class PlanTicks:
    """An executor and its vehicle, in the air 2 m above HOME unless a test says otherwise.

    Args:
        blocks: Of the plan, as XML.
        before: Sections before them.
        mapping: What names of a build mean.
    """

    def __init__(self, blocks, before="", *, mapping=None, plan=None):
        self.time, self.p, self.v, self.told = 0.0, (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), {}
        self.inputs: dict[str, Any] = {"armed": True, "flying": True}
        self.executor = FlightPlanExecutor(
            check_flown(plan or plan_of(blocks, before), mapping), self._inputs(), mapping or NameMapping()
        )
        self.events: list[Any] = []

    def _inputs(self):
        return PlanInputs(view_at(self.time, self.p, self.v, **self.told), WORLD, Settings(), **self.inputs)

    def tick(self, count=1):
        for _ in range(count):
            self.executor.update(self._inputs(), EnuPoint(*self.p), EnuPoint(*self.v))
            self.events += self.executor.take_events()
            self.time += PLAN_TICK
        return self

    def seconds(self, count):
        return self.tick(round(count / PLAN_TICK))

    @property
    def aim(self):
        return self.executor.aim

    def fly(self, seconds, speed=10.0):
        """Tick with a vehicle that follows every aim without a fault; gives the places it passed."""
        passed = []
        for _ in range(round(seconds / PLAN_TICK)):
            self.tick()
            self.p = moved(self.aim, self.p, speed * PLAN_TICK)
            passed.append(self.p)
        return passed

    @property
    def block(self):
        return self.executor.flow.present.name

    @property
    def stage(self):
        """The tag of the stage in force."""
        step = self.executor.flow.step
        return "" if step is None else step.stage.tag

    def variable(self, name):
        return self.executor.memory.variables[name]

    @property
    def entered(self):
        return [event.name for event in self.events if isinstance(event, BlockEntered)]

    @property
    def fired(self):
        return [event for event in self.events if isinstance(event, ExceptionFired)]

    @property
    def remarks(self):
        return [event.text for event in self.events if isinstance(event, PlanRemark)]
