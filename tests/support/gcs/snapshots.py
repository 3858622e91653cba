"""Snapshots of a vehicle in hover and in forward flight, with a value in every field that a screen shows."""

import math

from darko_gcs.state.parts import BatteryReading
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.state.values import Actuators, Air, Decision, Energy, HybridState, Jump, Navigation, Thresholds
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, Law, LegMode, Limit, Reason, Saturation
from protocol.frames import quaternion_from_euler
from protocol.plans import load
from sitl.defaults import HOME
from tests.support.paths import DATA

NOSE_UP = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
HYBRID_HOVER = HybridState(
    time=60.0,
    law=Law.HOVER_LINEAR,
    jumps=2,
    v_hover=0.8,
    v_forward=math.nan,
    v_attitude=math.nan,
    hover=Thresholds(50.0, 100.0),
    forward=Thresholds(20.0, 60.0),
    governor=0.0,
    last_law=Law.HOVER_ZERO_MOMENT,
    last_reason=Reason.LYAPUNOV_BELOW,
)
SLOTS = 16  # of DARKO_ENERGY.energy_by_law


def by_law(joules):
    """Energies [J] of some laws as they are on the wire."""
    return tuple(joules.get(number, 0.0) for number in range(SLOTS))


def snapshot_with(s, **parts):
    """A snapshot with other values in some parts: ``snapshot_with(s, status={"mode": "HOLD"})``."""
    return s._replace(**{name: getattr(s, name)._replace(**values) for name, values in parts.items()})


def values_of(s):
    """Every value of a snapshot, by its place: "position.p"."""
    parts = s._asdict()
    whole = {name: parts.pop(name) for name in ("flight_plan", "arena")}
    values = {f"{name}.{field}": value for name, part in parts.items() for field, value in part._asdict().items()}
    return {**values, **whole}


HOVERING = snapshot_with(
    EMPTY_SNAPSHOT,
    identity={"source": (1, 1), "autopilot": mavlink.MAV_AUTOPILOT_PX4, "kind": mavlink.MAV_TYPE_VTOL_DUOROTOR},
    status={"armed": True, "mode": "HOLD", "landed_state": mavlink.MAV_LANDED_STATE_IN_AIR, "prearm_ok": True},
    link={"heartbeat_at": 100.0, "boot": 60.0, "received": 100, "rate": 146.0},
    attitude={"q": NOSE_UP, "repr_offset": (math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0), "heading": 0.0},
    position={
        "p": (2.0, 1.0, -3.0),
        "v": (0.5, 0.0, 0.0),
        "home": HOME,
        "track": tuple((0.1 * n, 0.05 * n) for n in range(20)),
    },
    guidance={"target": (4.0, 0.0, -3.0)},
    estimates={"airspeed": 0.5, "wind": (0.0, 2.0, 0.0)},
    hybrid={
        "state": HYBRID_HOVER,
        "law_since": 48.0,
        "v_history": tuple((float(t), 10.0 ** (2 - t / 20), math.nan) for t in range(61)),
        "jumps": (
            Jump(
                time=48.0,
                number=2,
                source=Law.HOVER_ZERO_MOMENT,
                target=Law.HOVER_LINEAR,
                reason=Reason.LYAPUNOV_BELOW,
                name="enter_linear",
                v=49.9,
            ),
        ),
    },
    actuation={
        "actuators": Actuators(
            motor=(687.0, 1000.0),
            motor_command=(690.0, 1000.0),
            thrust=(2.4, 5.1),
            elevon=(0.1, -0.5),
            elevon_command=(0.1, -0.5),
            motor_min=200.0,
            motor_max=1000.0,
            elevon_max=0.5236,
            limits=Limit.MOTOR_RIGHT | Limit.ELEVON_RIGHT,
        )
    },
    battery={
        "battery_status": BatteryReading(voltage=12.4, charge_left=0.94),
        "energy": Energy(172.0, 5513.0, by_law({Law.LANDED: 8.0, Law.HOVER_LINEAR: 5505.0})),
    },
    plans={"mission": load(DATA / "square.plan").items},
    mission={"total": 6, "current": 2, "state": mavlink.MISSION_STATE_ACTIVE, "reached": frozenset({0, 1})},
)

FORWARD = snapshot_with(
    HOVERING,
    status={"mode": "MISSION", "vtol_state": mavlink.MAV_VTOL_STATE_FW},
    attitude={"q": quaternion_from_euler(0.2, 0.14, 0.5), "heading": 0.5},
    position={"v": (12.0, 6.0, -1.0)},
    estimates={"airspeed": 13.5, "air": Air((1.0, 2.0, 0.0), (1.2, 1.7, 0.1), 13.2, 13.4)},
    guidance={
        "navigation": Navigation(-1.7, 0.3, 42.0, 0.4),
        "decision": Decision(
            time=59.0,
            seq=3,
            leg_mode=LegMode.FORWARD,
            reason=DecisionReason.ENERGY,
            distance=100.0,
            climb=10.0,
            tail_wind=-1.2,
            cross_wind=0.5,
            hover_time=29.2,
            hover_energy=4983.0,
            forward_time=12.1,
            forward_energy=1757.0,
        ),
    },
    hybrid={
        "state": HYBRID_HOVER._replace(
            law=Law.FORWARD_LINEAR, jumps=5, v_hover=math.nan, v_forward=12.3, last_law=Law.FORWARD_LINE_OF_SIGHT
        ),
        "v_history": tuple(
            (float(t), 10.0 ** (2 - t / 20) if t < 40 else math.nan, 80.0 - t if t > 35 else math.nan)
            for t in range(61)
        ),
    },
    actuation={"saturated_at": {Saturation.YAW: 59.5, Saturation.PITCH: 60.0, Saturation.ROLL: 58.0}},
    battery={
        "energy": Energy(
            54.0,
            3920.0,
            by_law(
                {
                    Law.LANDED: 8.0,
                    Law.HOVER_LINEAR: 1500.0,
                    Law.HOVER_ZERO_MOMENT: 300.0,
                    Law.ALIGN: 110.0,
                    Law.TO_FORWARD: 900.0,
                    Law.FORWARD_LINE_OF_SIGHT: 600.0,
                    Law.FORWARD_LINEAR: 502.0,
                }
            ),
        )
    },
)
