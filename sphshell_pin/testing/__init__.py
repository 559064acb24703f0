"""Assertions on scenes, runs and shells for the test suites of other packages.

Each compares something with computations independent of the compiled core, raises AssertionError
with what, where and how much, and returns the error that it measured. With pytest the plugin
`pytest_sphshell_pin` adds fixtures that use them.
"""

from numpy.typing import ArrayLike

from sphshell_pin.dynamics import Result, Scene
from sphshell_pin.shell import Shell
from sphshell_pin.testing.conservation import elastic_energy, energy, momentum
from sphshell_pin.testing.differences import derivatives
from sphshell_pin.testing.finding import Finding as Finding
from sphshell_pin.testing.finding import Optional
from sphshell_pin.testing.forces import balance, reaction
from sphshell_pin.testing.found import contacts_of_scene, contacts_of_shell, passage


def assert_forces_balance(
    scene: Scene, q: ArrayLike, v: Optional = None, tau: Optional = None, tolerance: float = 1e-8
) -> float:
    """Assert that ABA with `scene.external_forces` gives M^-1 (tau - nle + J^T f).

    q (nq,), v (nv,) (default: at rest), tau (nv,) (default: zero); f the forces of
    `scene.contacts`, J the Jacobians of the contact points by Pinocchio. The error is that of the
    accelerations, sqrt(a . M a), relative to what the contacts add to them.

    Raises AssertionError, and InvalidParameter for a state that does not fit or a singular mass
    matrix.
    """
    return balance(scene, q, v, tau).require("the forces do not balance", tolerance)


def assert_wrenches_cancel(
    scene: Scene, q: ArrayLike, v: Optional = None, tolerance: float = 1e-12
) -> float:
    """Assert that the wrenches on all bodies sum to zero: action against reaction.

    Of scenes whose pairs join two moving bodies; InvalidParameter for one that touches the
    universe. The error is relative to the largest wrench.
    """
    return reaction(scene, q, v).require("action and reaction differ", tolerance)


def assert_momentum_kept(result: Result, tolerance: float = 1e-6) -> float:
    """Assert that linear and angular momentum of a closed system stay, within the impulse's share.

    Closed: no gravity, no controller, free-flyers at the roots; InvalidParameter otherwise. Judge
    by the order of the integrator and its step or tolerance.
    """
    return momentum(result).require("the momentum is not kept", tolerance)


def assert_energy_kept(result: Result, rtol: float = 1e-6) -> float:
    """Assert that the energy of a run adds up, relative to what changed form.

    Kinetic and potential energy by Pinocchio, the contacts' and the controller's by
    `result.energy`. Judge by the order of the integrator and its step or tolerance.
    """
    return energy(result).require("the energy does not add up", rtol)


def assert_lossless_energy_kept(result: Result, rtol: float = 1e-6) -> float:
    """Assert that kinetic, potential and k depth^(e + 1) / (e + 1) stay the same in sum.

    Of runs without damping, friction and controller (InvalidParameter otherwise); nothing of
    `result.energy` is used.
    """
    return elastic_energy(result).require("the energy does not add up", rtol)


def assert_derivatives(
    scene: Scene, q: ArrayLike, v: Optional = None, tau: Optional = None, tolerance: float = 1e-6
) -> float:
    """Assert that the analytic derivatives of forces and accelerations are those of differences.

    `scene.contact_derivatives`, and `scene.dynamics_derivatives` by q, v, tau and every number of
    the contacts' laws, friction, spheres and placements. Central differences of order 4 on the
    tangent space of q (nq,), by v (nv,), tau (nv,) and the numbers, with steps of 1e-3 to 1e-5 of
    the least depth. The error of a column is relative to its largest entry, or to a hundredth of
    the matrix's. Not where a contact just comes, goes or changes its feature, or its
    law or friction the branch: there is a kink.
    """
    return derivatives(scene, q, v, tau).require("the derivatives are wrong", tolerance)


def assert_no_contact_missed(
    shell: Shell,
    radius: float,
    centers: Optional = None,
    *,
    count: int = 200,
    seed: int = 0,
    method: str = "facets",
    tolerance: float = 1e-9,
) -> float:
    """Assert that `shell.contacts` finds what trying every triangle finds.

    A sphere of `radius` [m] at `centers` (n, 3) in the shell's frame [m], or at `count` random
    places: deep, barely touching, near and far. The same contact or none, the same depth, no ghost
    off the surface, and no piece of the surface within the sphere without its contact. The error is
    a length relative to the radius; with the method "smooth" the tolerance must leave room for the
    bulge of the curved elements. InvalidParameter for a one-sided shell.
    """
    finding = contacts_of_shell(shell, radius, centers, count=count, seed=seed, method=method)
    return finding.require("a contact is missed or made up", tolerance)


def assert_contacts_found(scene: Scene, q: ArrayLike, tolerance: float = 1e-9) -> float:
    """Assert the same of all pairs of a scene at q (nq,), placed by Pinocchio's frames."""
    return contacts_of_scene(scene, q).require("a contact is missed or made up", tolerance)


def assert_not_passed_through(result: Result) -> float:
    """Assert that no sphere's center went through its shell between two recorded rows of a run."""
    return passage(result).require("a sphere passed through its shell", 0.0)
