# For catkin_python_setup only; pip reads pyproject.toml.
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=["rapp_agent", "rapp_api", "rapp_core", "rapp_ros"], package_dir={"": "src"}, package_data={"rapp_api": ["js/*"]}
    )
)
