"""The certificate of hunting as a page and as lines of text: verdict, limit cycles and the map from break-away to break-away."""

import math

import numpy as np

from ..servo.hunting.certificate import HuntingCertificate, certified_in_words
from ..units.practical import practical
from ..verdict import State, Verdict
from .figure_style import FAINT, look
from .page import Prose, Report, Table
from .panels import Curve, Group, Mark, Panel

CAPTION = (
    "While the contact is stuck, the integrator winds up until it breaks away; the curve is the error that the slip leaves. Where it crosses "
    "the line of equal and opposite errors there is a limit cycle."
)
COMPUTED = (
    "Slip and stuck interval are linear, so that the map follows from their matrices. The verdict is shown by bounds of the map over "
    "intervals of errors, in floating point, widened by its rounding.",
    "It holds for starts at rest in which all but the integrator has settled, with the errors that are given.",
)
SAMPLED = "Shown by sets of states that contain every angle within a step of the encoder, and every instant of the break-away within a sample."
WITHOUT_STEPS = (
    "The error that a slip leaves, with an encoder without steps. Where the curve crosses the line of equal and opposite errors there is a "
    "limit cycle; the band in the table holds with the steps."
)
STATES: dict[str, State] = {"hunts": "does not fit", "does not hunt": "fits", "not decided": "not decided"}


def certificate_rows(certificate: HuntingCertificate) -> list[tuple[str, str]]:
    """Verdict, limit cycles and errors, as (what, value)."""
    unit = "rad" if certificate.map is None else str(certificate.map["error"].attrs["units"])
    rows = [("axis", certified_in_words(certificate))]
    for point in certificate.fixed_points:
        kind = "stable" if point.stable else "unstable"
        rows.append(("limit cycle", f"±{practical(point.amplitude, unit)}, {1.0 / point.period:.4g} Hz, {kind}"))
    if certificate.band is not None:
        rows.append(("never left", f"errors from {_range(certificate.band, unit)}"))
        rows.append(("reached from", f"errors from {', '.join(_range(one, unit) for one in certificate.ranges)}"))
    elif certificate.verdict == "does not hunt" and not math.isnan(certificate.factor):
        rows.append(("shown for", f"errors up to {practical(certificate.largest_error, unit)}"))
    if not math.isnan(certificate.reached):
        rows.append(("run sticks at", f"an error of {practical(certificate.reached, unit)}"))
    return rows


def _range(pair: tuple[float, float], unit: str) -> str:
    low, high = pair
    return f"{practical(low, unit)} to {practical(high, unit)}" if low > 0.0 else f"0 to {practical(high, unit)}"


def map_panels(certificate: HuntingCertificate) -> tuple[Panel, ...]:
    """The error left by a slip over the error at its start; none without a map."""
    found = certificate.map
    if found is None or not found.sizes["error"]:
        return ()
    unit, factor = ("µm", 1e6) if found["error"].attrs["units"] == "m" else ("arcmin", 60.0 * math.degrees(1.0))
    error, image = factor * found["error"].values, factor * found["image"].values
    ends = np.array([0.0, min(error.max(), max(-image.min(), 0.5 * error.max()))])
    curves = (Curve("after the slip", error, image, look(0)), Curve("equal and opposite", ends, -ends, FAINT))
    marks = tuple(
        Mark(factor * p.amplitude, -factor * p.amplitude, f"{1.0 / p.period:.3g} Hz", look(0))
        for p in certificate.fixed_points
    )
    labels = f"error at the break-away [{unit}]", f"error left [{unit}]"
    return (Panel("error left by a slip", *labels, curves, marks=marks, level=0.0),)


def certificate_parts(certificate: HuntingCertificate) -> list[Table | Group]:
    """The certificate as parts of the report of a sampled axis."""
    table = Table("Certificate of hunting", ("quantity", "value"), certificate_rows(certificate), SAMPLED)
    return [table, Group("hunting", "From break-away to break-away", WITHOUT_STEPS, map_panels(certificate), 1)]


def verdict_of(certificate: HuntingCertificate) -> Verdict:
    """Verdict on an axis with a continuous controller: whether it hunts."""
    lines = tuple(f"{what[0].upper()}{what[1:]}: {value}." for what, value in certificate_rows(certificate)[:3])
    return Verdict(STATES[certificate.verdict], lines)


def certificate_report(name: str, title: str, certificate: HuntingCertificate) -> Report:
    """The page of a certificate."""
    rows = certificate_rows(certificate)
    contact = f", contact `{certificate.contact}`" if certificate.contact else ""
    return Report(
        title=title or name,
        lead=f"Certificate of hunting of `{name}`{contact}.",
        verdict=verdict_of(certificate),
        main=Group("hunting", "From break-away to break-away", CAPTION, map_panels(certificate), 1),
        parts=(Table("Hunting", ("quantity", "value"), rows), Prose("What is computed", COMPUTED)),
        file="servo.html",
    )
