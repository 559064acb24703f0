"""A scene: a Pinocchio model and its contact pairs, and what they answer at a state."""

from __future__ import annotations

from collections.abc import Collection

import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_positive, check_type
from sphshell_pin.base.named_numbers import columns_of, names_of_pairs
from sphshell_pin.contact import Friction, NormalLaw
from sphshell_pin.dynamics.scene import derivatives
from sphshell_pin.dynamics.scene.explain import Explanation, explain_scene
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.dynamics.scene.scene_contacts import SceneContacts
from sphshell_pin.dynamics.scene.scene_parts import SceneParts
from sphshell_pin.dynamics.scene.scene_state import SceneState
from sphshell_pin.dynamics.scene.sphere_arguments import add_pairs

__all__ = ["ContactPair", "Scene", "SceneContacts", "SceneState"]


class Scene(SceneParts):
    """A copy of a Pinocchio model with the contact pairs that act on it.

    `lock` names joints to hold at their values in `q_lock` (nq of the given model, default
    neutral): they drop out of the scene's model and cost nothing. `joints` says what else acts in
    the joints, for instance JointComponents.from_model(model): by default nothing, as in
    Pinocchio. Joints that mimic others (pinocchio's mimic=True) move exactly so: nq and nv count
    independent coordinates. FrameNotFound and NameNotFound list what the model has.
    """

    @classmethod
    def from_geometry(
        cls,
        model: pin.Model,
        geometry_model: pin.GeometryModel,
        law: NormalLaw,
        friction: Friction | None = None,
    ) -> Scene:
        """Build a scene from the active collision pairs of a geometry model.

        Of each pair one side must be a sphere; the other may be one, too, else it becomes a shell
        (meshes as they are, primitives tessellated with their exact normals). Other pairs are left
        out; a geometry model without any sphere pair raises InvalidParameter.
        """
        scene = cls(model)
        add_pairs(scene, geometry_model, law, friction)
        return scene

    def state(self, q: ArrayLike | None = None, v: ArrayLike | None = None) -> SceneState:
        """Return the memory of friction and contacts for your own loop, beginning at q, v.

        Without q it begins at its first `advance`. A pair that is added or replaced later needs
        a new state.
        """
        return SceneState(self, q, v)

    def external_forces(
        self, q: ArrayLike, v: ArrayLike | None = None, state: SceneState | None = None
    ) -> pin.StdVec_Force:
        """Return the contact wrenches for pin.aba(model, data, q, v, tau, fext).

        One pinocchio.Force per joint, in the joint's frame about its origin; q (nq,), v (nv,)
        (default: at rest). Bristles have the stretch that `state` holds, without one they are
        unstretched: friction then creeps as if it had no spring.
        """
        return self._at(state).external_forces(q, v)

    def joint_forces(
        self, q: ArrayLike, v: ArrayLike | None = None, state: SceneState | None = None
    ) -> Array:
        """Return the torques (nv,) of stops, damping and dry friction in the joints [N m or N].

        They are to be added to those of the motors: pin.aba(model, data, q, v, tau + these, fext).
        `state` as in `external_forces`: without one, springs of dry friction are unstretched.
        """
        return self._at(state).joint_forces(q, v)

    def contact_derivatives(
        self, q: ArrayLike, v: ArrayLike | None = None, state: SceneState | None = None
    ) -> tuple[Array, Array]:
        """Return the derivatives (nv, nv) of the generalised contact force by q and by v.

        That force is the sum of J^T f over the joints, with f the `external_forces` at q (nq,),
        v (nv,) (default: at rest) and J the joints' Jacobians. The first is taken in the tangent
        space of q, along which pinocchio.integrate moves; units are those of force [N] or torque
        [N m] per [m] or [rad], and per [m/s] or [rad/s]. Where nothing touches both are zero.

        They are analytic and exact where contacts go on; where one comes, goes or changes its
        feature they are those of one side. Approximate: with the method "elements" each normal
        keeps its direction in the shell; contacts of a source, which does not say how they move,
        stay where they are in frame j, and their depth changes by the motion of body i at the
        point along the normal. `state` as in `external_forces`; its bristles are held.
        """
        return self._at(state).contact_derivatives(q, v)

    def contact_force_derivatives(
        self,
        q: ArrayLike,
        v: ArrayLike | None = None,
        *,
        parameters: Collection[str] = (),
        state: SceneState | None = None,
    ) -> derivatives.ContactForceDerivatives:
        """Return the contacts at q (nq,), v (nv,), and how their forces and depths change.

        `parameters` and `state` as in `dynamics_derivatives`; what is approximate is said in
        `contact_derivatives`.
        """
        columns, core = self._bind_parameters(parameters, state)
        found = self._at(state).contact_force_derivatives(q, v, core)
        return derivatives.ContactForceDerivatives.from_core(*found, self._model.nv, columns)

    def dynamics_derivatives(
        self,
        q: ArrayLike,
        v: ArrayLike | None = None,
        tau: ArrayLike | None = None,
        *,
        parameters: Collection[str] = (),
        state: SceneState | None = None,
    ) -> derivatives.DynamicsDerivatives:
        """Return the acceleration at q (nq,), v (nv,) under the torques tau (nv,), and derivatives.

        v and tau are zero unless given. By q, v and tau they are pinocchio's
        computeABADerivatives with those of the contacts, stops and dampers; what is approximate is
        said in `contact_derivatives`. `parameters` are names: "PAIR.law.FIELD",
        "PAIR.friction.FIELD", "PAIR.sphere.radius" and "PAIR.other_sphere.radius" (a column each),
        "PAIR.sphere.offset" and "PAIR.other_sphere.offset" (three columns, .x .y .z),
        "PAIR.placement" of the shell (six columns .vx .vy .vz .wx .wy .wz: placement * exp6(x) at
        x = 0). By fields of laws and friction, and what a radius changes besides the depth, the
        forces of each contact are differenced, right to about nine digits; the rest is analytic.

        `state` as in `external_forces`. Friction with bristles has a memory that q and v do not
        hold: without `state` its springs are unstretched, with one they are held as they are.

        Raises NameNotFound for a parameter that the scene does not have, InvalidParameter for
        wrong sizes.
        """
        columns, core = self._bind_parameters(parameters, state)
        found = self._at(state).dynamics_derivatives(q, v, tau, core)
        return derivatives.DynamicsDerivatives(*found, columns)

    def _bind_parameters(
        self, parameters: Collection[str], state: SceneState | None = None
    ) -> tuple[tuple[str, ...], list[_core.Parameter]]:
        """Return the columns of the `parameters`, and each as the core takes it."""
        if isinstance(parameters, tuple) and not parameters:
            return (), []
        columns = columns_of(parameters, names_of_pairs(self.pairs))
        return columns, derivatives.core_parameters(
            self, columns, None if state is None else state.start
        )

    def contacts(
        self, q: ArrayLike, v: ArrayLike | None = None, state: SceneState | None = None
    ) -> SceneContacts:
        """Return all contacts with their forces at q (nq,), v (nv,) (default: at rest).

        `state` as in `external_forces`; contacts then have its ids.
        """
        return SceneContacts.from_rows(self._at(state).contacts(q, v))

    def constraints(
        self, q: ArrayLike, v: ArrayLike | None = None, state: SceneState | None = None
    ) -> derivatives.ContactConstraints:
        """Return all contacts at q (nq,), v (nv,) for Pinocchio's own solvers of constraints.

        Their laws are not in them but for the stiffness: ADMM and PGS compute forces that hold the
        bodies apart, with Coulomb's cones. `state` as in `contacts`.
        """
        contacts = self.contacts(q, v, state)
        return derivatives.constraints_of(
            self.model, self.pairs, self.check_state(q, v)[0], contacts
        )

    def _at(self, state: SceneState | None) -> _core.Scene | _core.SceneState:
        if state is None:
            return self._binding
        check_type("state", state, SceneState, "must be a SceneState: scene.state(q, v)")
        return state.core_of(self)

    def explain(
        self, q: ArrayLike | None = None, v: ArrayLike | None = None, dt: float | None = None
    ) -> Explanation:
        """Say what is modelled and what not, time scales, expected depths, and warnings.

        q (nq,) (default neutral), v (nv,) the speed of approach to judge by, `dt` [s] a step to
        judge.
        """
        q, v = self.check_state(self.neutral if q is None else q, v)
        return explain_scene(self, q, v, None if dt is None else check_positive("dt", dt, "s"))
