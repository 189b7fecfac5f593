"""Choices that a derivative takes as they are: which rows are active, who is nearest."""

CHOICE = "choice"
"""Name under which `jax.ad_checkpoint.checkpoint_name` marks them. They have no derivative and are small, so that reverse mode keeps
them, `jax.checkpoint_policies.save_only_these_names(CHOICE)`, and need not search again."""
