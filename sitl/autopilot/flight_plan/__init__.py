"""Flight plans in flight: which block and stage is in force, and where it sends the vehicle.

Decisions only: a plan's tick gives an aim, the steering makes references of it through ``sitl.guidance``, and what the
motors shall do are requests to the autopilot. Plans are in their own frame: east, north and up of the plan's origin.
"""
