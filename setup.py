"""Which packages are installed: the programs and their named settings within `hrcjax`, so that no other name is taken."""

from pathlib import Path

from setuptools import find_packages, setup

programs = [
    name.replace("experiments", "hrcjax.programs", 1)
    for name in find_packages(include=["experiments", "experiments.*"])
]
settings = sorted({f"hrcjax.configs.{path.parent.name}" for path in Path("configs").glob("*/*.toml")})
setup(
    packages=[
        *find_packages(include=["hrcjax", "hrcjax.*"]),
        *programs,
        "hrcjax.configs",
        *settings,
    ],
    package_dir={"hrcjax.programs": "experiments", "hrcjax.configs": "configs"},
    package_data={"hrcjax": ["py.typed"], **{name: ["*.toml"] for name in settings}},
)
