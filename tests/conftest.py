"""Property tests draw the same examples on every run; HYPOTHESIS_PROFILE=explore looks for new ones."""

import os

from hypothesis import settings
from hypothesis.internal.conjecture import providers

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("explore", deadline=None, print_blob=True)
PROFILE = os.environ.get("HYPOTHESIS_PROFILE", "repeatable")
settings.load_profile(PROFILE)

if PROFILE == "repeatable":
    # Hypothesis mixes in constants of the modules imported so far: a test's examples would depend on the tests before.
    providers._get_local_constants = providers.Constants
