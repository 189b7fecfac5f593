"""Which packages are installed: the programs and their named settings within `hrcjax`, so that no other name is taken."""

from setuptools import find_packages, setup

programs = [
    name.replace("experiments", "hrcjax.programs", 1)
    for name in find_packages(include=["experiments", "experiments.*"])
]
setup(
    packages=[
        *find_packages(include=["hrcjax", "hrcjax.*"]),
        *programs,
        "hrcjax.configs",
        "hrcjax.configs.avoidance",
        "hrcjax.configs.sensing",
        "hrcjax.configs.sweep",
        "hrcjax.configs.tune",
        "hrcjax.configs.tune_benchmark",
    ],
    package_dir={"hrcjax.programs": "experiments", "hrcjax.configs": "configs"},
    package_data={
        "hrcjax": ["py.typed"],
        "hrcjax.configs.avoidance": ["*.toml"],
        "hrcjax.configs.sensing": ["*.toml"],
        "hrcjax.configs.sweep": ["*.toml"],
        "hrcjax.configs.tune": ["*.toml"],
        "hrcjax.configs.tune_benchmark": ["*.toml"],
    },
)
