"""Time: the compiled loop of plant, estimate, supervisor and laws, single flights and batches, and their public API."""
