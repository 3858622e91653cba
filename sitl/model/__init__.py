"""The plant: airframe, aerodynamics, actuators, ground and air, as pure functions on named scalars.

Conventions (report, section "Référentiels"; signs corrected where the report's own typed ones disagree
with its printed matrices):

* World frame I is NWU: x north, y west, z up; gravity is (0, 0, -g).
* Body frame B is FLU: x along the motors, y along the left wing, z completes. At q = (1, 0, 0, 0) the nose
  points north; nose-up is a *negative* rotation about y; hover is q = (1/sqrt2, 0, -1/sqrt2, 0) turned
  about the vertical by any heading.
* delta > 0 is trailing edge such that the moment is nose-up, a negative M_y.
* Quaternions are (w, x, y, z) and R(q) maps body to world. SI units, radians.

Nothing here knows a control law.
"""
