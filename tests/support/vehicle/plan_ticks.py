"""A flight plan ticked by hand: the vehicle is where a test says, and no time passes but what it asks for."""

from protocol.flight_plans.name_mapping import NameMapping
from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.plan_geometry import EnuPoint
from protocol.frames import Geodetic, LocalFrame
from sitl.autopilot.flight_plan.executor import PLAN_TICK, FlightPlanExecutor
from sitl.autopilot.flight_plan.operator_view import BlockEntered, ExceptionFired, PlanRemark
from sitl.autopilot.flight_plan.plan_inputs import PlanInputs
from sitl.autopilot.safety.arena import ARENAS
from sitl.autopilot.safety.world import World
from sitl.autopilot.settings import Settings
from sitl.guidance.view import VehicleView
from tests.support.plans import plan_of

WORLD = World(LocalFrame(Geodetic(43.5641, 1.4829, 100.0)), ARENAS["open"])


def view_at(time, p=(0.0, 0.0, 0.0), v=(0.0, 0.0, 0.0), **told):
    """A vehicle at a point east, north and up."""
    north_west_up = (p[1], -p[0], p[2])
    velocity = (v[1], -v[0], v[2])
    told = {"heading": 0.0, "tilt": 0.0, "landed": p[2] <= 0.2, "battery_remaining": 1.0} | told
    return VehicleView(time=time, p=north_west_up, v=velocity, **told)


class PlanTicks:
    """An executor and its vehicle, in the air 2 m above HOME unless a test says otherwise.

    Args:
        blocks: Of the plan, as XML.
        before: Sections before them.
        mapping: What names of a build mean.
    """

    def __init__(self, blocks, before="", *, mapping=None, plan=None):
        self.time, self.p, self.v, self.told = 0.0, (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), {}
        self.inputs = {"armed": True, "flying": True}
        self.executor = FlightPlanExecutor(
            check_flown(plan or plan_of(blocks, before), mapping), self._inputs(), mapping or NameMapping()
        )
        self.events = []

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
