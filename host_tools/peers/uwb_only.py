"""Each UWB report solved for a position by itself: weighted least squares on the slant ranges.

A path through three or four walls is far off what its model says: such ranges count less, by how
little they agree with the rest (Cauchy weights).

Contract: reports come padded, (reports, records) with anchor -1 where a record is missing;
a report with fewer than three usable anchors gives NaN, never a guess.
"""

import numpy as np

ITERATIONS = 25
PLAIN_ITERATIONS = 6  # before residuals say anything about a range
CAUCHY = 2.4  # standard deviations at which a range counts half
TOF_SIGMA_M = 0.1
SPREAD_MIN = 0.005
STEP_MAX_M = 2.0
SOURCE_STRENGTH = 1
SOURCE_FLIGHT = 2


def ranges_m(strength_cdb, range_mm, model):
    """Slant range of each record and its standard deviation, infinite if it must not be used."""
    if model["source"] == SOURCE_FLIGHT:
        slant = np.asarray(range_mm, float) / 1000.0
        return slant, np.where(slant > 0, TOF_SIGMA_M, np.inf)
    # Paper eq. 3 with one sample: alpha removes the bias of the log-normal error, whose spread grows with the range.
    strength_db, gamma = np.asarray(strength_cdb, float) / 100.0, model["gamma"]
    spread = np.log(10) * model["sigma_db"] / (10 * gamma)
    slant = np.exp(-spread ** 2 / 2) * 10 ** ((model["level_1m_db"] - strength_db) / (10 * gamma))
    return slant, np.where(strength_db >= model["level_min_db"], max(spread, SPREAD_MIN) * np.maximum(slant, 0.5), np.inf)


def positions(anchor, strength_cdb, range_mm, model, anchors):
    """(reports, 2) positions. `anchors` is (n, 3): x, y and height above the receiver, in metres."""
    anchor = np.asarray(anchor)
    if not len(anchor) or not len(anchors) or not model["source"]:
        return np.full((len(anchor), 2), np.nan)
    slant, deviation = ranges_m(strength_cdb, range_mm, model)
    known = (anchor >= 0) & (anchor < len(anchors))
    weight = np.where(known, deviation, np.inf) ** -2.0
    place = np.asarray(anchors, float)[np.where(known, anchor, 0)]
    enough = (weight > 0).sum(axis=1) >= 3
    solved = _refine(_first_guess(place, slant, weight), place, slant, weight)
    return np.where(enough[:, None], solved, np.nan)


def _first_guess(place, slant, weight):
    """Differences of squared ranges are linear in the position."""
    total = np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)
    squared = np.maximum(slant ** 2 - place[..., 2] ** 2, 0) - place[..., 0] ** 2 - place[..., 1] ** 2
    a = -2 * place[..., :2]
    a = a - ((weight[..., None] * a).sum(axis=1) / total)[:, None, :]
    b = squared - (weight * squared).sum(axis=1, keepdims=True) / total
    centre = (weight[..., None] * place[..., :2]).sum(axis=1) / total
    guess = _solve2(a, b, weight, 1e-9)
    return np.where(np.isfinite(guess).all(axis=1, keepdims=True), guess, centre)


def _refine(xy, place, slant, weight):
    for iteration in range(ITERATIONS):
        away = xy[:, None, :] - place[..., :2]
        predicted = np.sqrt((away ** 2).sum(axis=2) + place[..., 2] ** 2)
        error = slant - predicted
        trust = weight if iteration < PLAIN_ITERATIONS else weight / (1 + error ** 2 * weight / CAUCHY ** 2)
        step = _solve2(away / np.maximum(predicted, 1e-6)[..., None], error, trust, 1e-6)
        length = np.maximum(np.hypot(step[:, 0], step[:, 1]), 1e-12)[:, None]
        xy = xy + step * np.minimum(1, STEP_MAX_M / length)
    return xy


def _solve2(a, b, weight, damping):
    """Weighted normal equations of two unknowns, one system a report."""
    weighted = a * weight[..., None]
    scale = np.maximum((weighted * a).sum(axis=(1, 2)), 1e-12) * damping
    xx = (weighted[..., 0] * a[..., 0]).sum(axis=1) + scale
    yy = (weighted[..., 1] * a[..., 1]).sum(axis=1) + scale
    xy = (weighted[..., 0] * a[..., 1]).sum(axis=1)
    bx, by = (weighted[..., 0] * b).sum(axis=1), (weighted[..., 1] * b).sum(axis=1)
    det = xx * yy - xy * xy
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.column_stack([(yy * bx - xy * by) / det, (xx * by - xy * bx) / det])
