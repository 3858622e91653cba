"""A flight plan's table and status as a vehicle sends them, without a vehicle."""

from protocol.dialect import mavlink

NAN = float("nan")


def block(number, name="", **told):
    texts = {"strip_button": b"", "shortcut": b"", "group": b"", "locked": b""} | told
    return mavlink.MAVLink_darko_plan_block_message(0, 0, number, (name or f"B{number}").encode(), **texts)


def waypoint(number, east=0.0, north=0.0, up=2.0, name=""):
    return mavlink.MAVLink_darko_plan_waypoint_message(
        0, 435641000, 14829000, 100.0 + up, east, north, up, 0, number, 1, (name or f"W{number}").encode()
    )


def variable(number, value=1.0, name=""):
    return mavlink.MAVLink_darko_plan_variable_message(
        0, value, 0.0, 9.0, 1.0, 0, number, (name or f"v{number}").encode(), b"", b"m"
    )


def sector(number, corners=(1, 2, 3), name="Room"):
    told = [*corners, *[0] * (60 - len(corners))]
    return mavlink.MAVLink_darko_plan_sector_message(0, 0, number, told, 1, name.encode())


def table(blocks=12, waypoints=15, variables=3):
    return [
        *(block(number) for number in range(blocks)),
        *(waypoint(number) for number in range(1, waypoints + 1)),
        *(variable(number) for number in range(1, variables + 1)),
        sector(1),
    ]


def status(ms=0, block=0, name=b"plan"):
    return mavlink.MAVLink_darko_plan_status_message(ms, 0, 0, 1.0, 0.5, 9.0, 0, 0, block, 0, 7, 1, name, b"stay wp=A")


def event(text="x > 1", kind=mavlink.DARKO_PLAN_EVENT_KIND_EXCEPTION, at=1.0):
    return mavlink.MAVLink_darko_plan_event_message(round(at * 1e6), 0, 0, 12, 0, 1, kind, text.encode())
