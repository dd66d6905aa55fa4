"""Values that a study takes from its runs: result variables, reductions of them, energies, the drive check."""

from .study_definition import Study


def asks_for(study: Study, name: str) -> bool:
    """Whether an expression uses a name that is no result variable."""
    return any(name in e.names for e in study.expressions.values())


def used(study: Study) -> set[str]:
    """The result variables that its expressions use."""
    return {name for e in study.expressions.values() for name in e.variables}


def needed(study: Study) -> frozenset[str]:
    """The result variables that the study uses."""
    return frozenset(used(study) | set(study.trajectories.variables if study.trajectories else ()))


def reductions(study: Study) -> dict[str, tuple[str, str]]:
    """Reduction and variable of each column that needs samples, if the core can compute all of them. No samples need
    leave the core then. Otherwise empty."""
    all_of_them = {name: e.reduction for name, e in study.expressions.items() if e.variables}
    known = {name: r for name, r in all_of_them.items() if r is not None}
    return known if study.trajectories is None and len(known) == len(all_of_them) else {}


def channels(study: Study) -> list[str]:
    """The channels of the core that the needed variables are made of: all, if one follows from others."""
    wanted, given = needed(study), study.vocabulary.channels
    return sorted(wanted) if wanted <= set(given) else list(given)


def checks_drives(study: Study) -> bool:
    """Whether each run goes through the drive check."""
    return study.select is not None and study.select.drive_check
