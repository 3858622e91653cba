"""The rigid body that is shipped: TOML with a unit and a source for every value."""
