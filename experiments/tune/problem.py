"""What is tuned on what: parameters, terms of the loss, worlds, and exact metrics. A closed loop, or anything of this form."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.cells.check import check_cell
from hrcjax.cells.named_cell import NamedCell, find_cell
from hrcjax.cells.people import make_person
from hrcjax.cells.ur5 import CELLS
from hrcjax.cells.worlds import build_world
from hrcjax.io.motions.spec import people_of
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.lab.parameters import leaf_names
from hrcjax.lab.progress import Progress
from hrcjax.lab.provenance import fingerprint
from hrcjax.metrics.episode import METRICS
from hrcjax.sim import Params, World, episode, outcome
from hrcjax.tune import Chosen, Loss, choose, episode_terms, parse_losses
from hrcjax.tune.checked import check_losses
from hrcjax.tune.given import given_params
from hrcjax.tune.stages import Stages
from hrcjax.typing import Array
from hrcjax.world import scene_named

from .config import TuneConfig

JUDGED = ("score_sound", "success", "time_to_goal", "clearance", "separation", "energy", "time_below_sp")
"""Exact metrics that the report shows."""
QUICK = 3.0
"""Length of a quick episode [s]."""
WorldName = tuple[str, str, int]
"""Scene, person, seed."""


@dataclass(frozen=True)
class Problem:
    """A tuning problem."""

    base: Any
    """Parameters before tuning."""
    chosen: Chosen
    """Those that are tuned."""
    losses: tuple[Loss, ...]
    """Terms of the loss."""
    weights: tuple[float, ...]
    """Of each [1/unit]."""
    terms: Callable[[Any, Any], Array]
    """(params, world) -> every term."""
    measure: Callable[[Any, Any], Mapping[str, Array]]
    """(params, world) -> exact metrics by name, each a scalar."""
    units: Mapping[str, tuple[str, str]]
    """Unit, and "low" or "high" is better, of every metric."""
    training: Mapping[str, Any]
    """Worlds by name."""
    held_out: Mapping[str, Any]
    """Worlds that the tuning does not see."""
    stages: Stages | None = None
    """The same as `terms`, in stages that are programs of their own; None: there are none."""
    identity: str | None = None
    """Of everything but the losses in the stages' programs; None: they are not kept on disk."""
    parts: Callable[[Any], Mapping[str, Any]] = lambda world: {"world": world}
    """World -> what makes it new, all but noise."""

    def params_of(self, vector: Array) -> Any:
        """Parameters of a vector of coordinates."""
        return self.chosen.params(self.base, vector)


def world_names(config: TuneConfig) -> tuple[list[WorldName], list[WorldName]]:
    """Worlds to train in, and those held out.

    Raises:
        UsageError: a world is in both, or there is none to train in.
    """
    train = list(product(config.scenes, config.people, config.seeds))
    scenes, people = config.held_out_scenes or config.scenes, config.held_out_people or config.people
    held = list(product(scenes, people, config.held_out_seeds))
    both = set(train) & set(held)
    if both:
        raise UsageError(f"{word(sorted(both)[0])} is in training and held out; give other --held-out-seeds")
    if not train:
        raise UsageError("no world to train in: --scenes, --people and --seeds accept one or more values each")
    for scene, person, seed in train + held:
        try:
            for one in people_of(person):
                make_person(one, scene_named(scene, 0), 0, 1.0)
        except (ValueError, OSError) as error:
            raise UsageError(one_line(error)) from error
        if not 0 <= seed < 2**32:
            raise UsageError(f"--seeds {seed}: accepted is 0 to {2**32 - 1}")
    return train, held


def word(name: WorldName) -> str:
    """A world's name as text."""
    return f"{name[0]}-{name[2]}-{name[1]}"


def named_cell(config: TuneConfig) -> NamedCell:
    """The cell with room for the people and obstacles of all worlds, and the parameters to start from; of a short episode in a
    quick run."""
    named = find_cell(config.cell, CELLS)
    every = [name for part in world_names(config) for name in part]
    people = max(*(len(people_of(person)) for _, person, _ in every), named.cell.people)
    most = max(int(np.sum(scene_named(scene, seed).mask)) for scene, _, seed in every)
    named = replace(named, cell=replace(named.cell, people=people, obstacles=max(most, 1)))
    if named.code:  # not a built-in one
        check_cell(named)
    if config.quick:
        ticks = min(named.cell.ticks, round(QUICK / named.cell.dt))
        named = replace(named, cell=replace(named.cell, ticks=ticks))
        text = f"quick: an episode of {ticks * named.cell.dt:g} s, in which a slow arm does not arrive"
        print(text, file=sys.stderr, flush=True)
    given = given_params(named.params, config.start_from, "--from", named.known_domains())
    if given.place:
        print(given.line(), file=sys.stderr, flush=True)
    return replace(named, params=given.params)


def closed_loop(config: TuneConfig, named: NamedCell, build: Callable[..., World] = build_world) -> Problem:
    """Whole episodes of a cell; its worlds are sensed here, some seconds each."""
    cell = named.cell
    chosen = choose(config.params, named.params, named.known_aliases(), named.known_domains(), config.frozen)
    losses, weights = parse_losses(config.loss)
    train, held = world_names(config)

    def play(params: Params, world: World) -> Any:
        return episode(params, cell, world, cell.field.fit(params.field, world.frames))

    def measure(params: Params, world: World) -> Mapping[str, Array]:
        run = play(params, world)
        metrics = outcome(params, cell, world, run).metrics
        each = {f"loss {one.name}": jnp.asarray(one.of(params, cell, world, run)) for one in losses}
        total = sum(w * value for w, value in zip(weights, each.values(), strict=True))
        return {name: getattr(metrics, name) for name in JUDGED} | each | {"loss": jnp.asarray(total)}

    stages = Stages(cell, losses, weights, lambda vector: chosen.params(named.params, vector), chosen.names)
    units = {name: METRICS[name][:2] for name in JUDGED} | {f"loss {one.name}": (one.unit, "low") for one in losses}
    made: dict[WorldName, World] = {}
    with Progress(len(train + held), unit="world") as progress:
        for name in train + held:
            made[name] = build(cell, *name)
            if len(made) == 1:
                check_losses(losses, named.params, cell, made[name], play)
            progress.advance(1)
    _same_shapes(list(made.values()))
    return Problem(
        base=named.params,
        chosen=chosen,
        losses=losses,
        weights=weights,
        terms=episode_terms(cell, losses),
        stages=stages if any(loss.of_episode for loss in losses) else None,
        identity=program_identity(named, chosen),
        measure=measure,
        units=units | {"loss": ("1", "low")},
        training={word(name): made[name] for name in train},
        held_out={word(name): made[name] for name in held},
        parts=lambda world: {"scene": world.scene, "people": world.person},
    )


def program_identity(named: NamedCell, chosen: Chosen) -> str | None:
    """Of what programs close over beside the code and the losses; None for a cell that is not built in: its programs are not kept."""
    if named.identity is None or named.code:
        return None
    parts = ("arm", "field", "safety")  # the identity names them
    sizes = {name: str(value) for name, value in vars(named.cell).items() if not callable(value) and name not in parts}
    known = {"cell": named.identity, "sizes": sizes, "params": leaf_names(named.params)}
    return fingerprint(known | {"chosen": [*chosen.names], "bounds": str(chosen.bounds)})


def _same_shapes(worlds: Sequence[Any]) -> None:
    shapes = {tuple(jnp.shape(leaf) for leaf in jax.tree.leaves(world)) for world in worlds}
    if len(shapes) > 1:
        raise UsageError("the worlds have arrays of different sizes; accepted are scenes and people of equal sizes")
