"""The controller as a module of an autopilot: the files besides its own, by path in the folder of the export.

Paparazzi: the folder is ``sw/airborne/modules/ctrl_darko``, and what is in its ``conf`` goes over Paparazzi's own. The
autopilot's XML calls the module by itself, so that no structure of a stabilisation's set-points is needed. PX4: the
folder is ``src/modules/darko_control``, a scheduled work item between uORB topics, control allocation left out.
"""

from __future__ import annotations

from math import pi, radians

from protocol.dialect.vocabulary import Law
from sitl.export.templates import template

FULL_SPEED_RPM = 16066  # of a motor at Paparazzi's full command, as ENAC's airframe files scale it
FULL_TRAVEL_DEG = 30  # of an elevon there

_VALUES = {
    "@motor@": f"{FULL_SPEED_RPM * pi / 30.0:.2f}",
    "@elevon@": f"{radians(FULL_TRAVEL_DEG):.6f}",
    "@zero_moment@": str(int(Law.HOVER_ZERO_MOMENT)),
    "@landed@": str(int(Law.LANDED)),
}
FILES: dict[str, dict[str, str]] = {  # templates by where they go, by autopilot
    "plain": {},
    "paparazzi": {
        "conf/modules/ctrl_darko.xml": "paparazzi/ctrl_darko_module.xml",
        "conf/autopilot/darko.xml": "paparazzi/darko_autopilot.xml",
        "conf/airframes/darko_section.xml": "paparazzi/darko_airframe.xml",
        "ctrl_darko.h": "paparazzi/ctrl_darko.h",
        "ctrl_darko.c": "paparazzi/ctrl_darko.c",
        "darko_frames.h": "darko_frames.h",
    },
    "px4": {
        "CMakeLists.txt": "px4/CMakeLists.txt",
        "Kconfig": "px4/Kconfig",
        "DarkoControl.hpp": "px4/DarkoControl.hpp",
        "DarkoControl.cpp": "px4/DarkoControl.cpp",
        "darko_design.c": "px4/darko_design.c",
        "darko_design.h": "px4/darko_design.h",
        "darko_frames.h": "darko_frames.h",
    },
}


def module_files(autopilot: str) -> dict[str, str]:
    """Files of an autopilot's module.

    Args:
        autopilot: One of ``FILES``.
    """
    made = {}
    for place, name in FILES[autopilot].items():
        text = template(name)
        for word, value in _VALUES.items():
            text = text.replace(word, value)
        made[place] = text
    return made
