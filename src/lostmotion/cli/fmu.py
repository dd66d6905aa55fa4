"""`lostmotion fmu`."""

from pathlib import Path

from .arguments import Overrides, SourceArgument, flag, load_scenario, option
from .output_files import try_file
from .terminal import about, busy

SYSTEMS = {"linux": "Linux", "windows": "Windows", "darwin": "macOS"}


def fmu(
    scenario: SourceArgument,
    output: Path = option("FILE.fmu", "The FMU.", "-o", "--output", default=...),
    overrides: Overrides = None,
    controllers: bool = flag(
        "With the controllers of the scenario inside, or motors turned by commands.", default=True
    ),
    fmi: int = option("2|3", "Version of the standard: 2.0 or 3.0.", default=2),
    references: bool = flag(
        "The references of sampled controllers are inputs, which replace those of the scenario.", "--reference-inputs"
    ),
    source: bool = flag("With the C++ sources too, for tools and targets that compile FMUs themselves.", "--source"),
    motion_inputs: list[str] | None = option(
        "SHAFT",
        "A shaft or slide whose position, speed and acceleration are inputs; its torque or force is an output. May be repeated.",
    ),
    libraries: Path | None = option("DIRECTORY", "Libraries of the platforms, if others than the installed ones."),
) -> None:
    """To use a drive in Simulink and other tools: write an FMU.

    \b
    lostmotion fmu position-axis -o axis.fmu --fmi 3 --set load.inertia="3 kg*m^2"
    lostmotion fmu drive.toml -o drive.fmu
    lostmotion fmu position-axis -o axis.fmu --source
    lostmotion fmu given-motion -o crank.fmu --motion-inputs crank

    An FMU is for Co-Simulation and Model Exchange.

    Inputs are commands, load torques and references of continuous controllers. Each follows its signal in the scenario until the importer sets it. Outputs are the result variables; parameters have the keys of the scenario file.
    """
    from ..errors import InputError
    from ..portable.fmu_export import export_fmu

    if output.suffix != ".fmu":
        raise InputError(f"{output}: must end in .fmu")
    try_file(output)
    loaded = load_scenario(scenario, overrides)
    with about(scenario), busy("Writing"):
        replaced = export_fmu(
            loaded,
            output,
            fmi=fmi,
            controllers=controllers,
            references=references,
            source=source,
            motion_inputs=motion_inputs or (),
            libraries=libraries,
        )
    print(f"FMU written to {output}")
    print(_platforms(output))
    for name, key in replaced.items():
        print(f"Input {name} replaces {loaded.key_in_file(key)} of the scenario as soon as the importer sets it.")
    print(f"Try it with FMPy: fmpy simulate {output} --show-plot")


def _platforms(path: Path) -> str:
    """The line that says where an FMU runs."""
    from zipfile import ZipFile

    from ..portable.fmu_export import PLATFORMS

    builds = {place: build for each in PLATFORMS.values() for build, (place, _) in each.items()}
    with ZipFile(path) as file:
        found = {name.split("/")[1] for name in file.namelist() if name.startswith("binaries/")}
    processors = [builds[name].partition("-") for name in sorted(found)]
    shown = ", ".join(f"{SYSTEMS[system]} {processor.replace('_', '-')}" for processor, _, system in processors)
    rest = (
        "." if len(found) >= len(set(builds.values())) else "; `make fmu` adds the others of Linux, Windows and macOS."
    )
    return f"It runs on {shown}{rest}"
