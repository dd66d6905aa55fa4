"""Random and quasi-random designs of studies: points of the unit cube; any part can be made by itself."""

import warnings
from functools import lru_cache

import numpy as np

from ...errors import need

CHUNK = 500  # runs that are computed, and written, as one


def unit_cube(design: str, parameters: int, total: int, seed: int, first: int, last: int) -> np.ndarray:
    """The points first .. last - 1 of a design, one row each, within 0 and 1, both excluded.

    design: ``"sobol"``, ``"saltelli"``, ``"random"`` or ``"latin_hypercube"``.
    parameters: columns.
    total: points of the whole design.
    """
    if design == "sobol":
        points = _sobol(parameters, seed, first, last)
    elif design == "saltelli":
        points = _saltelli(parameters, total // (2 * parameters + 2), seed)[first:last]
    elif design == "random":
        # Each chunk has its own stream, so that any part can be made without those before it.
        chunks = range(first // CHUNK, (last - 1) // CHUNK + 1)
        rows = np.concatenate([np.random.default_rng([seed, c]).random((CHUNK, parameters)) for c in chunks])
        begin = first - chunks[0] * CHUNK
        points = rows[begin : begin + last - first]
    else:
        points = _latin_hypercube(parameters, total, seed)[first:last]
    return np.asarray(np.clip(points, 1e-12, 1.0 - 1e-12))


def _sobol(parameters: int, seed: int, first: int, last: int) -> np.ndarray:
    from scipy.stats import (
        qmc,  # takes a second to import: here, where progress is shown and bad input has been refused
    )

    sampler = qmc.Sobol(parameters, scramble=True, rng=np.random.default_rng(seed))
    if first:
        sampler.fast_forward(first)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a part need not be a power of two
        return np.asarray(sampler.random(last - first))


@lru_cache(maxsize=2)  # one part after the other is asked for
def _latin_hypercube(parameters: int, total: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    out = np.empty((total, parameters))
    for k in range(parameters):
        strata, inside = rng.permutation(total), rng.random(total)
        out[:, k] = (strata + inside) / total
    return out


@lru_cache(maxsize=2)
def _saltelli(parameters: int, base: int, seed: int) -> np.ndarray:
    need("SALib", "The design saltelli", "study")
    from SALib.sample import sobol

    names = [str(k) for k in range(parameters)]
    problem = {"num_vars": parameters, "names": names, "bounds": [[0.0, 1.0]] * parameters}
    return np.asarray(sobol.sample(problem, base, calc_second_order=True, seed=seed))
