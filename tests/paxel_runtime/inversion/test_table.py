"""Colour tables against closed forms, against a plain reference, and against the function they stand for."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.inversion import build_mapping_table, build_table, invert, look_up
from paxel_runtime.model.colorimetry import Lab_to_sRGB, sRGB_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel

Models = Callable[[int], PredictionModel]
PICTURE = np.random.default_rng(0).integers(0, 256, (60, 50, 3)).astype(np.uint8)


def tetrahedral(table: NDArray[np.float32], colour: NDArray[np.uint8]) -> NDArray[np.float64]:
    """The slow, obvious reference: walk from the cell's dark corner along its axes, largest fraction first."""
    place = colour.astype(np.float64) * (len(table) - 1) / 255
    corner = np.minimum(place.astype(int), len(table) - 2)
    fraction = place - corner
    order = next(o for o in permutations(range(3)) if fraction[o[0]] >= fraction[o[1]] >= fraction[o[2]])
    value, at = table[tuple(corner)].astype(np.float64), corner.copy()
    for axis in order:
        before = table[tuple(at)].astype(np.float64)
        at[axis] += 1
        value += fraction[axis] * (table[tuple(at)] - before)
    return value


def test_the_kernel_is_the_plain_reference(bw_model: Models) -> None:
    model = bw_model(2)
    table = build_table(lambda Lab: np.abs(np.sin(Lab @ np.ones((3, 6)) * np.arange(6))), model, nodes=5)
    x = look_up(table, PICTURE)
    reference = [tetrahedral(table.x, colour) for colour in PICTURE.reshape(-1, 3)]
    np.testing.assert_allclose(x.reshape(-1, 6), reference, atol=1e-6)  # float32


def test_an_affine_function_of_the_codes_is_exact(bw_model: Models) -> None:
    slopes = np.random.default_rng(1).uniform(0, 1 / 3, (3, 6))
    table = build_table(lambda Lab: Lab_to_sRGB(Lab.astype(np.float64)) @ slopes, bw_model(2), nodes=4)
    np.testing.assert_allclose(look_up(table, PICTURE), PICTURE / 255 @ slopes, atol=1e-5)  # sRGB -> Lab -> sRGB
    assert table.dE00_max < 0.01


def test_the_error_stated_is_the_error_of_pictures(bw_model: Models) -> None:
    """A faint picture on the pattern while white stays gray: all through `invert`."""
    model = bw_model(3)

    def shown(Lab: NDArray[np.float32]) -> NDArray[np.floating]:
        small = Lab * np.float32([0.1, 0.15, 0.15]) + np.float32([25, 0, 0])
        return invert(small, np.broadcast_to(np.float32([55, 0, 0]), Lab.shape), model).x

    coarse, fine = build_table(shown, model, nodes=9), build_table(shown, model, nodes=17)
    assert fine.dE00_p99 < coarse.dE00_p99 / 2, "twice the nodes, a quarter of the error where x is smooth"
    exact = shown(sRGB_to_Lab(PICTURE.reshape(-1, 3) / 255).astype(np.float32))
    found = look_up(fine, PICTURE).reshape(-1, model.n)
    error = np.maximum(*(dE00(a, b) for a, b in zip(model.predict(exact), model.predict(found), strict=True)))
    assert np.quantile(error, 0.99) <= fine.dE00_p99
    # Colours that leave the box on the way across a cell bend x more sharply than the bound's quadratic.
    assert np.mean(error <= fine.dE00_bound) >= 0.999
    assert found.min() >= 0
    assert found.max() <= 1


def test_the_bound_holds_for_a_quadratic() -> None:
    """Of the codes, in L*: nowhere more than 3/2 of the error at the middles of edges, here in every 8-bit colour."""

    def curved(Lab: NDArray[np.float32]) -> NDArray[np.floating]:
        r, g, b = np.moveaxis(Lab_to_sRGB(Lab.astype(np.float64)), -1, 0)
        L = 50 + 20 * r * r - 15 * g * b + 10 * (r - b) ** 2
        return np.stack([L, np.zeros_like(L), np.zeros_like(L)], axis=-1)

    table = build_mapping_table(curved, nodes=5)
    every = np.stack(np.meshgrid(*[np.arange(0, 256, 3, dtype=np.uint8)] * 3), axis=-1).reshape(-1, 3)
    error = dE00(curved(sRGB_to_Lab(every / 255).astype(np.float32)), look_up(table, every))
    # dE00 weighs a difference in L* by a factor that varies by 1 % across a cell, and sRGB -> Lab -> sRGB is float32.
    assert 0.9 * table.dE00_max < error.max() <= 1.01 * table.dE00_bound


def test_a_mapping_table_stands_for_its_mapping() -> None:
    def soft(Lab: NDArray[np.float32]) -> NDArray[np.floating]:
        chroma = np.hypot(Lab[:, 1], Lab[:, 2])
        scale = 20.0 / (20.0 + chroma)
        return np.stack([30 + 0.4 * Lab[:, 0], scale * Lab[:, 1], scale * Lab[:, 2]], axis=-1)

    coarse, table = build_mapping_table(soft, nodes=9), build_mapping_table(soft)
    wanted = soft(sRGB_to_Lab(PICTURE / 255).reshape(-1, 3).astype(np.float32))
    error = dE00(wanted, look_up(table, PICTURE).reshape(-1, 3))
    assert np.quantile(error, 0.99) <= table.dE00_p99
    assert error.max() <= table.dE00_bound < coarse.dE00_bound / 2


def test_what_does_not_fit_is_named(bw_model: Models) -> None:
    model = bw_model(2)
    with pytest.raises(InputError, match="2 to 65 nodes"):
        build_table(lambda Lab: np.zeros((len(Lab), 6)), model, nodes=1)
    with pytest.raises(InputError, match="finite values"):
        build_table(lambda Lab: np.zeros((len(Lab), 5)), model, nodes=2)
    with pytest.raises(InputError, match="finite values"):
        build_table(lambda Lab: np.full((len(Lab), 6), np.nan), model, nodes=2)
    table = build_table(lambda Lab: np.zeros((len(Lab), 6)), model, nodes=2)
    with pytest.raises(InputError, match="uint8"):
        look_up(table, PICTURE / 255)
