"""Value and gradient of whole episodes as separate programs.

They are compiled side by side in threads, and kept on disk as `hrcjax.lab.traced` keeps programs. Every term of the loss is a program;
its weight is an argument: other weights compile nothing, another term its own program alone.

    plan -> path, route      fit -> fields      ticks -> record      terms -> values, and derivatives by all of these
    ticks back               fit back           plan back            : derivatives by the coordinates, added up

Programs pass flat lists of arrays; forward ones give what their reverse (`jax.vjp`) needs beside their results.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp

from hrcjax.lab.provenance import PACKAGE, code_digest
from hrcjax.lab.traced import traced
from hrcjax.numerics import unrolled_options
from hrcjax.tune.declared import LOSSES, Loss
from hrcjax.tune.stages import Stages, torque_clipped, weighted
from hrcjax.tune.step import Values

Flat = dict[str, Any]
TUNE_CODE = code_digest(PACKAGE / "tune")
"""Digest of the code of this package when it was imported."""
THREADS = 2
"""Programs compiled at once."""


def is_float(leaf: Any) -> bool:
    """Whether an array can have a derivative."""
    return jnp.issubdtype(leaf.dtype, jnp.inexact)


def apart(tree: Any) -> tuple[list[Any], list[Any]]:
    """The arrays of a tree that can have a derivative, and the others."""
    leaves = jax.tree.leaves(tree)
    return [a for a in leaves if is_float(a)], [a for a in leaves if not is_float(a)]


def together(like: Any, floats: list[Any], rest: list[Any]) -> Any:
    """The tree of the arrays of `apart`.

    Args:
        like: a tree of this form.
    """
    leaves, shape = jax.tree.flatten(like)
    ones, others = iter(floats), iter(rest)
    return jax.tree.unflatten(shape, [next(ones if is_float(leaf) else others) for leaf in leaves])


def shapes_of(tree: Any) -> Any:
    """Shapes and types of the arrays of a tree."""
    return jax.tree.map(lambda a: jax.ShapeDtypeStruct(jnp.shape(a), jnp.result_type(a)), tree)


class StagedGradient:
    """As `values_and_gradients`, of episodes, for vectors and worlds of one shape.

    Derivatives are those of `Cell.linear_servo`. Where a torque was clipped they do not hold: programs with the exact ones are then
    compiled and used.

    Attributes:
        compile_s: time until all programs were compiled [s].
        clipped: calls that needed the exact ones.
    """

    def __init__(
        self, stages: Stages, vectors: Any, worlds: Any, identity: str | None = None, linear: bool = True
    ) -> None:
        """Traces and compiles.

        Args:
            vectors: (start, parameter), for their shape.
            worlds: stacked, for their shapes.
            identity: of everything but the losses; None: nothing is kept on disk.
            linear: False: exact derivatives of the servo.
        """
        self.stages = replace(stages, cell=replace(stages.cell, linear_servo=linear))
        self.identity, self.linear, self.clipped = identity, linear, 0
        self.exact: StagedGradient | None = None
        self.times: dict[str, float] | None = None
        self.args: dict[str, tuple[Any, ...]] = {}
        self.functions: dict[str, Callable[..., Flat]] = {}
        self.likes: dict[str, Any] = {}
        self.pulls: dict[str, Any] = {}
        self.terms: dict[str, Loss] = {}
        self.programs: dict[str, Any] = {}
        given = shapes_of(vectors), shapes_of(worlds)
        begin = time.monotonic()
        with ThreadPoolExecutor(THREADS) as pool:
            plan = self._make(pool, "plan", self._plan, given)
            fit = self._make(pool, "fit", self._fit, given)
            ticks = self._make(pool, "ticks", self._ticks, (*given, *_results(plan), *_results(fit)))
            self._make(pool, "ticks back", self._back("ticks"), (ticks["kept"], ticks["floats"]))
            for name, out in (("plan", plan), ("fit", fit)):
                if out["kept"]:
                    self._make(pool, f"{name} back", self._back(name), (out["kept"], out["floats"]))
            self.given = *given, *_results(plan), *_results(ticks)
            self._make_terms(pool, self.stages.losses)
        self._await(begin)

    def new_loss(self, stages: Stages) -> None:
        """Takes the losses and weights of other stages: the programs of terms that are new are compiled. If one fails, all stays as
        it was."""
        before, begin = (dict(self.programs), dict(self.terms)), time.monotonic()
        try:
            with ThreadPoolExecutor(THREADS) as pool:
                self._make_terms(pool, stages.losses)
            self._await(begin)
        except BaseException:
            self.programs, self.terms = before
            raise
        if self.exact is not None:
            self.exact.new_loss(stages)
        self.stages = replace(self.stages, losses=stages.losses, weights=stages.weights)

    def _make_terms(self, pool: ThreadPoolExecutor, losses: Sequence[Loss]) -> None:
        names = [loss.name for loss in losses]
        if len(set(names)) < len(names):
            raise ValueError(f"losses {', '.join(names)}: accepted is each name once")
        args = (*self.given, jax.ShapeDtypeStruct((), self.given[0].dtype))
        for loss in losses:
            if self.terms.get(loss.name) is not loss:
                self._make(pool, loss_program(loss), self._term(loss), args, kept=LOSSES.get(loss.name) is loss)
                self.terms[loss.name] = loss

    def _await(self, begin: float) -> None:
        self.programs = {name: one.result() if isinstance(one, Future) else one for name, one in self.programs.items()}
        self.compile_s = time.monotonic() - begin

    def __call__(self, vectors: Any, worlds: Any) -> Values:
        """Losses, terms and gradients of every start."""
        plan, fit = self._run("plan", vectors, worlds), self._run("fit", vectors, worlds)
        ticks = self._run("ticks", vectors, worlds, *_results(plan), *_results(fit))
        if self.linear and bool(ticks["clipped"]):
            self.clipped += 1
            if self.exact is None:
                self.exact = StagedGradient(self.stages, vectors, worlds, self.identity, linear=False)
            return self.exact(vectors, worlds)
        tuned = self.stages
        found = [
            self._run(
                loss_program(loss),
                vectors,
                worlds,
                *_results(plan),
                *_results(ticks),
                jnp.asarray(weight, vectors.dtype),
            )
            for loss, weight in zip(tuned.losses, tuned.weights, strict=True)
        ]
        by_vectors, by_plan, by_ticks = _added([one["by"] for one in found])
        by_vector, *others = self._run("ticks back", ticks["kept"], by_ticks)["by"]
        gradient = by_vectors + by_vector
        if tuned.plan_tuned and "plan back" in self.programs:
            by_plan = _added([by_plan, others[0]])
            gradient = gradient + self._run("plan back", plan["kept"], by_plan)["by"][0]
        if tuned.fields_tuned and "fit back" in self.programs:
            gradient = gradient + self._run("fit back", fit["kept"], others[-1])["by"][0]
        each = jnp.stack([one["each"] for one in found], axis=-1)
        return Values(weighted(each, tuned.weights), each, gradient)

    def timed(self, vectors: Any, worlds: Any) -> dict[str, float]:
        """Time of every program in a call [s]."""
        self.times = {}
        self(vectors, worlds)
        times, self.times = self.times, None
        return times

    def _run(self, name: str, *args: Any) -> Flat:
        begin = time.monotonic()
        out = self.programs[name](*jax.tree.leaves(args))
        if self.times is not None:
            jax.block_until_ready(out)
            self.times[name] = time.monotonic() - begin
        return out

    def _make(
        self, pool: ThreadPoolExecutor, name: str, f: Callable[..., Flat], args: tuple[Any, ...], kept: bool = True
    ) -> Flat:
        """Traces a program here and compiles it in the pool; the shapes of its results.

        Args:
            kept: on disk, if anything is: not what the identity and the code of this package do not tell.
        """
        self.args[name], self.functions[name] = args, f
        known = code_digest(PACKAGE / "tune") == TUNE_CODE  # else it was edited since the start
        kept = kept and known and self.identity is not None
        mark = f"{self.identity} {TUNE_CODE} {name} linear {self.linear}" if kept else None
        program = traced(f, args, mark)
        lowered = program.lower()
        self.programs[name] = pool.submit(lambda: lowered.compile(compiler_options=unrolled_options()))
        return dict(program.out_info)

    def _like(self, name: str) -> Any:
        """The form of a stage's results; traced anew where its program was on disk."""
        if name not in self.likes:
            jax.eval_shape(self.functions[name], *self.args[name])
        return self.likes[name]

    def _forward(self, name: str, f: Callable[..., Any], *args: Any) -> Flat:
        """f(*args), flat, with what its reverse by the args needs; without args no reverse."""

        def flat(*some: Any) -> tuple[list[Any], list[Any]]:
            found = f(*some)
            self.likes[name] = shapes_of(found)
            return apart(found)

        if not args:
            floats, rest = flat()
            return {"floats": floats, "rest": rest, "kept": []}
        floats, pull, rest = jax.vjp(flat, *args, has_aux=True)
        kept, self.pulls[name] = jax.tree.flatten(pull)
        return {"floats": floats, "rest": rest, "kept": kept}

    def _back(self, name: str) -> Callable[..., Flat]:
        def back(kept: list[Any], cotangents: list[Any]) -> Flat:
            self._like(name)
            return {"by": list(jax.tree.unflatten(self.pulls[name], kept)(cotangents))}

        return back

    def _plan(self, vectors: Any, worlds: Any) -> Flat:
        if self.stages.plan_tuned:
            return self._forward("plan", lambda v: self.stages.plan(v, worlds), vectors)
        return self._forward("plan", lambda: self.stages.plan(vectors, worlds))

    def _fit(self, vectors: Any, worlds: Any) -> Flat:
        if self.stages.fields_tuned:
            return self._forward("fit", lambda v: self.stages.fit(v, worlds), vectors)
        return self._forward("fit", lambda: self.stages.fit(vectors, worlds))

    def _ticks(self, vectors: Any, worlds: Any, plan: Any, plan_rest: Any, fit: Any, fit_rest: Any) -> Flat:
        tuned, plan_like, fit_like = self.stages, self._like("plan"), self._like("fit")

        def ticks(v: Any, *some: Any) -> Any:
            given = list(some)
            route = together(plan_like, given.pop(0) if tuned.plan_tuned else plan, plan_rest)[1]
            fields = together(fit_like, given.pop(0) if tuned.fields_tuned else fit, fit_rest)
            return tuned.ticks(v, worlds, route, fields)

        out = self._forward("ticks", ticks, vectors, *[plan] * tuned.plan_tuned, *[fit] * tuned.fields_tuned)
        run = together(self._like("ticks"), out["floats"], out["rest"])
        return out | {"clipped": torque_clipped(run)}

    def _term(self, loss: Loss) -> Callable[..., Flat]:
        def term(
            vectors: Any, worlds: Any, plan: Any, plan_rest: Any, ticks: Any, ticks_rest: Any, weight: Any
        ) -> Flat:
            plan_like, ticks_like = self._like("plan"), self._like("ticks")

            def total(v: Any, plan: Any, ticks: Any) -> tuple[Any, Any]:
                run = together(ticks_like, ticks, ticks_rest)
                each = self.stages.term(loss, v, worlds, together(plan_like, plan, plan_rest)[0], run)
                # each start has its own derivatives
                return weight * jnp.sum(jnp.mean(each, axis=1)), each

            derivatives, each = jax.grad(total, argnums=(0, 1, 2), has_aux=True)(vectors, plan, ticks)
            return {"each": each, "by": list(derivatives)}

        return term


def loss_program(loss: Loss) -> str:
    """Name of the program of a term."""
    return f"loss {loss.name}"


def _added(trees: list[Any]) -> Any:
    return jax.tree.map(lambda *leaves: sum(leaves[1:], leaves[0]), *trees)


def _results(out: Mapping[str, Any]) -> tuple[Any, Any]:
    return out["floats"], out["rest"]
