from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import find_packages, setup

setup(
    **generate_distutils_setup(
        packages=find_packages("src"),
        py_modules=["vision_definitions"],
        package_dir={"": "src"},
        package_data={"rapp_nao_sim.world": ["*.toml"]},
    )
)
