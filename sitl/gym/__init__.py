"""Environments of gymnasium, for agents that learn to fly: ``import sitl.gym`` registers them.

Their names: ``DarkO/Hover-v0``, ``DarkO/Transition-v0``, ``DarkO/Leg-v0``, ``DarkO/Fall-v0``, ``DarkO/Gust-v0``.
"""

from sitl.errors import SitlError

try:
    import gymnasium
except ImportError as error:
    raise SitlError("gymnasium is missing: pip install 'darko[gym]'") from error

from sitl.gym.flight_batch import INTERVAL_PERIODS
from sitl.gym.flight_tasks import TASKS
from sitl.sensors.draws import PERIOD

NAMESPACE = "DarkO"

for _name, _task in TASKS.items():
    if f"{NAMESPACE}/{_name}-v0" not in gymnasium.registry:
        gymnasium.register(
            f"{NAMESPACE}/{_name}-v0",
            entry_point="sitl.gym.environments:DarkoEnv",
            vector_entry_point="sitl.gym.environments:DarkoVectorEnv",
            max_episode_steps=round(_task.seconds / (INTERVAL_PERIODS * PERIOD)),
            kwargs={"task": _name},
        )
