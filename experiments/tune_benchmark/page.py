"""The page of a run, as Markdown."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .compare import LOSS, lost_worlds, ranked
from .kinds import lines, never
from .problem import SCORE, TERMS
from .results import REFERENCE, Found, cells, verdicts

PAGE = """# Tuning by gradient against other methods

Written by the program; do not edit. Research software, not safety-rated.

```
{command}
```

Code {commit}; {versions}; {platform}.{quick}

## What is compared
The same {parameters} parameters, `{names}`, are tuned within the same bounds in {training} worlds, and judged by exact metrics of
the true system in {held} worlds that no method has seen. `motion.speed`, `motion.clock.acceleration` and `safety.*` stay as they are: the score
is measured by them.

| | worlds |
|---|---|
| training | {training_names} |
| held out | {held_names} |

**Compute** is counted in forward episodes. Every method has up to {budget:.0f} of them for each of its seeds ({seeds}), the sweep {sweep:.0f} once, and the
defaults none. {ratio} Whatever a method looks at counts, its choice at the end too. Wall time is the mean over seeds, compilation apart. The
seeds of a method run side by side and share calls and their time. Forward calls have room for {at_once} settings; a call that is not
full costs as much wall time, but fewer episodes.

**Methods.** All but the sweep know the defaults. `gradient`: Adam with a rate of {rate:g} on the smooth loss
`{loss}`, each step in all training worlds; starts: {starts}. `quasi_newton`: L-BFGS-B of SciPy on the same loss from the same starts, again from new ones
where it has converged. Both choose at the end among {choices} of their candidates by the true score. `random`: uniform within the
bounds, by the logarithm where both are positive. `cma_es`: from the defaults with a deviation of 1 in the coordinates without bounds.
`sweep`: `{grid}`. These three optimise the true score, which has steps that no gradient sees.

## Held-out worlds
Means over seeds of the method and worlds; a score that is not finite counts as 0, other metrics are left out there. Intervals are those of
the bootstrap over worlds, with all seeds of a method in each, and over its seeds.

{table}

{verdicts}

In {never} of {held} held-out worlds no run of any method succeeds{never_names}: they are in the means above, and rank nothing. Mean scores in the
others, by what of a world was seen in training:

{kinds}

## Where gradient loses
{losses}

## Figures
In the run's folder, `{folder}/figures`: {figures}. What each method ended with is in `{folder}/choices`, for `--params` of the programs.
"""


def markdown(lines: Sequence[Sequence[str]]) -> str:
    """A table, its first line the head."""
    head, *others = (f"| {' | '.join(line)} |" for line in lines)
    return "\n".join([head, "|" + "---|" * len(lines[0]), *others])


def losses_text(found: Found) -> str:
    """Where the gradient is behind which method, and by what; written from the numbers."""
    if REFERENCE not in found.scores:
        return "It did not take part."
    metrics, said = found.held_out, []
    for method in ranked(found.scores):
        if method == REFERENCE:
            continue
        lost = lost_worlds(metrics[REFERENCE], metrics[method], found.worlds, SCORE, TERMS)
        if not lost:
            said.append(f"* Against {method}: in no world by more than {LOSS:g} points.")
            continue
        parts = [f"{one.world} by {one.behind:.1f} ({_term(one.term, one.by)})" for one in lost]
        said.append(f"* Against {method} in {len(lost)} of {len(found.worlds)} worlds: {', '.join(parts)}.")
    return f"Worlds in which it is more than {LOSS:g} points behind, mean over seeds, with the term that is behind most:\n\n" + "\n".join(said)  # fmt: skip


def _term(name: str, by: float) -> str:
    if name == "success":
        return f"{100 * by:.0f} % fewer runs succeed"
    return f"{name.removeprefix('sound_')} {by:.1f} of 100 lower" if name else "no term is known"


def ratio_text(costs: Mapping[str, float], given: float) -> str:
    """What the gradient counts as."""
    if given:
        return f"A value and gradient of one counts as {given:g}, as given."
    if not costs:
        return ""
    return (
        f"A value and gradient of one counts as {costs['ratio']:.2f}: the median of three warm calls takes {costs['gradient_s']:.2f} s, a "
        f"forward call of the same episodes {costs['forward_s']:.2f} s ({costs['packed_ratio']:.2f} against full calls of the forward program)."
    )


def page(
    found: Found, problem: Any, config: Any, origin: Mapping[str, Any], said: Mapping[str, str], groups: Mapping[str, Sequence[int]]
) -> str:  # fmt: skip
    """The whole page.

    Args:
        groups: kinds of held-out worlds and their places.
        said: command, folder and figures, as text.
    """
    sweep, lost = found.entries.get("sweep"), never(found.held_out)
    used = ", ".join(f"{name} {version}" for name, version in origin["versions"].items())
    return PAGE.format(
        command=said["command"],
        commit=origin["commit"],
        versions=used,
        platform=origin["platform"],
        quick="\n\n**A quick run: episodes of 3 s, in which nothing arrives. It shows that the program runs, and no more.**"
        if config.quick
        else "",
        parameters=len(problem.chosen.names),
        names="`, `".join(problem.chosen.names),
        training=len(problem.training),
        held=len(problem.held_out),
        training_names=", ".join(problem.training),
        held_names=", ".join(problem.held_out),
        budget=found.budget,
        seeds=", ".join(map(str, config.seeds_of_methods)),
        sweep=np.mean([one.spent for one in sweep]) if sweep else 0,
        ratio=ratio_text(found.costs, config.ratio),
        at_once=config.at_once,
        rate=config.rate,
        starts=config.starts,
        loss=" ".join(config.loss),
        choices=config.choices,
        grid=" ".join(config.grid),
        table=markdown(cells(found)),
        never=int(lost.sum()),
        never_names=f" ({', '.join(np.array(found.worlds)[lost])})" if lost.any() else "",
        kinds=markdown(lines(found.held_out, groups)),
        verdicts="\n".join(f"* {line}" for line in verdicts(found)),
        losses=losses_text(found),
        folder=said["folder"],
        figures=said["figures"],
    )
