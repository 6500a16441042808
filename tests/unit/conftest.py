"""Equations of motion and an arm to put into them. Nothing here loads casadi before it is used."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def equations_folder(pytestconfig: pytest.Config) -> Path:
    """Where built equations are kept between test runs."""
    return pytestconfig.cache.mkdir("equations")


@pytest.fixture(scope="session")
def quaternion_equations(equations_folder: Path):
    """Compiled equations in quaternions."""
    from cached_equations import cached_equations

    return cached_equations("quaternion", equations_folder)


@pytest.fixture(scope="session")
def euler_equations(equations_folder: Path):
    """Compiled equations in Euler angles."""
    from cached_equations import cached_equations

    return cached_equations("euler", equations_folder)


@pytest.fixture(params=["quaternion", "euler"])
def equations(request: pytest.FixtureRequest):
    """Compiled equations of each formulation in turn."""
    return request.getfixturevalue(f"{request.param}_equations")
