"""The screens of the ground station. They ask; only the app talks to the vehicle."""
