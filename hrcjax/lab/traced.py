"""Cache of traced programs between runs, beside the compilation cache: loading is faster than tracing."""

import contextlib
import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import jax

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.errors import StorageError
from hrcjax.lab.provenance import LOADED_CODE, code_digest, fingerprint, versions

DIGEST = 32
"""Length of the digest at the beginning of a cached program [bytes]."""


def _digest(program: bytes) -> bytes:
    return hashlib.sha256(program).digest()


def traced(evaluate: Callable[..., Mapping[str, Any]], args: tuple[Any, ...], identity: str | None) -> Any:
    """`evaluate` traced for arguments like `args`; call and compile it with `jax.tree.leaves(args)`.

    With an identity it is cached in the folder of JAX's compilation cache, under a digest of the code, the versions, the
    identity and the shapes; without that folder there is no cache. A damaged file is ignored.

    Args:
        identity: identifies everything that `evaluate` closes over. None: no cache.
    """
    leaves, tree = jax.tree.flatten(args)

    def flat(*leaves: Any) -> dict[str, Any]:
        return dict(evaluate(*jax.tree.unflatten(tree, leaves)))

    cache = jax.config.jax_compilation_cache_dir  # pyright: ignore[reportAttributeAccessIssue]  # set at run time
    if identity is None or not cache:
        return jax.jit(flat).trace(*leaves)
    shapes = [f"{jax.typeof(leaf)} {getattr(leaf, 'weak_type', '')}" for leaf in leaves]
    backend = f"{jax.default_backend()} {jax.config.jax_enable_x64}"  # pyright: ignore[reportAttributeAccessIssue]
    key = fingerprint(
        {"code": LOADED_CODE, "versions": versions(), "of": [identity, str(tree), *shapes], "on": backend}
    )
    path = Path(cache) / "traced" / key
    with contextlib.suppress(Exception):  # an unreadable cache file is ignored
        kept = path.read_bytes()
        if kept[:DIGEST] == _digest(kept[DIGEST:]):
            exported = jax.export.deserialize(bytearray(kept[DIGEST:]))
            return jax.jit(exported.call).trace(*leaves)
    exported = jax.export.export(jax.jit(flat))(*leaves)
    if code_digest() == LOADED_CODE:  # not if the code was edited since the start
        with contextlib.suppress(StorageError, OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            program = bytes(exported.serialize())
            write_bytes(path, _digest(program) + program)
    return jax.jit(exported.call).trace(*leaves)
