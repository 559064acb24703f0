#include "bindings/interop.hpp"

#include <limits>
#include <memory>

#include "bindings/arrays.hpp"
#include "bindings/records.hpp"
#include "dynamics/linearization.hpp"
#include "dynamics/simulation.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

namespace sphshell {
namespace {

using RowPoints = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

SE3 to_se3(const Eigen::Matrix4d& m) {
  return SE3(Eigen::Matrix3d(m.topLeftCorner<3, 3>()), Vec3(m.topRightCorner<3, 1>()));
}

// The callable returns points, normals and depths, checked and converted by its Python wrapper.
ContactSource make_source(nb::object find) {
  auto shared = std::shared_ptr<nb::object>(new nb::object(std::move(find)), [](nb::object* p) {
    nb::gil_scoped_acquire acquire;
    delete p;
  });
  return [shared](const SE3& pose_i, const SE3& pose_j, std::vector<Contact>& out) {
    nb::gil_scoped_acquire acquire;
    const nb::object result = (*shared)(to_python(pose_i), to_python(pose_j));
    const auto points = nb::cast<RowPoints>(result[0]);
    const auto normals = nb::cast<RowPoints>(result[1]);
    const auto depths = nb::cast<VectorX>(result[2]);
    for (Eigen::Index i = 0; i < depths.size(); ++i)
      if (depths[i] > 0)
        out.push_back({points.row(i).transpose(), normals.row(i).transpose(), depths[i],
                       static_cast<int>(i), Feature::Face});
  };
}

std::unique_ptr<Pair> make_pair(std::string name, int joint_i, const Eigen::Matrix4d& placement_i,
                                int joint_j, const Eigen::Matrix4d& placement_j, double radius,
                                std::shared_ptr<Shell> shell, nb::object source, int method,
                                const NormalLaw& law, const FrictionLaw* friction) {
  auto pair = std::make_unique<Pair>();
  pair->name = std::move(name);
  pair->joint_i = joint_i;
  pair->joint_j = joint_j;
  pair->placement_i = to_se3(placement_i);
  pair->placement_j = to_se3(placement_j);
  pair->radius = radius;
  pair->shell = std::move(shell);
  if (!source.is_none()) pair->source = make_source(std::move(source));
  pair->method = static_cast<Method>(method);
  pair->law = law;
  if (friction) pair->friction = *friction;
  return pair;
}

// A Python callable tau(t, q, v, contacts): contacts as rows, its Python wrapper gives them names.
class PythonController : public Controller {
 public:
  explicit PythonController(nb::object callable) : callable_(std::move(callable)) {}
  ~PythonController() override {
    nb::gil_scoped_acquire acquire;
    callable_.reset();
  }
  bool follows_time() const override { return true; }
  void torque(Scene& scene, double t, const VectorX& q, const VectorX& v, VectorX& tau) override {
    std::vector<ContactRow> rows;
    scene.log(q, v, rows);
    nb::gil_scoped_acquire acquire;
    tau = nb::cast<VectorX>(callable_(t, q, v, rows_to_array(std::move(rows))));
  }

 private:
  nb::object callable_;
};

std::vector<Vec3> to_points(const RowPoints& rows) {
  std::vector<Vec3> out;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) out.push_back(rows.row(i).transpose());
  return out;
}

// At a state of its own, no part of a run: bristles are not stretched.
void evaluate_alone(Scene& scene, const VectorX& q, const VectorX& v) {
  scene.restart();
  scene.evaluate(q, v, VectorX::Zero(scene.bristle_size()));
}

}  // namespace
}  // namespace sphshell

void bind_dynamics(nanobind::module_& m) {
  using namespace sphshell;
  nb::class_<Pair>(m, "Pair")
      .def_rw("relaxation", &Pair::relaxation)
      .def(nb::new_(&make_pair), nb::arg("name"), nb::arg("joint_i"), nb::arg("placement_i"),
           nb::arg("joint_j"), nb::arg("placement_j"), nb::arg("radius"), nb::arg("shell").none(),
           nb::arg("source").none(), nb::arg("method"), nb::arg("law"), nb::arg("friction").none());

  nb::class_<Scene>(m, "Scene")
      .def(
          "__init__",
          [](Scene* scene, nb::handle model, const std::vector<const Pair*>& pairs) {
            new (scene) Scene(model_of(model), copies(pairs));
          },
          nb::arg("model"), nb::arg("pairs"))
      .def("external_forces",
           [](Scene& scene, const VectorX& q, const VectorX& v) {
             evaluate_alone(scene, q, v);
             const Forces none(scene.touching() ? 0 : scene.external().size(),
                               pinocchio::Force::Zero());
             return to_python(scene.touching() ? scene.external() : none);
           })
      .def("contacts",
           [](Scene& scene, const VectorX& q, const VectorX& v) {
             std::vector<ContactRow> rows;
             evaluate_alone(scene, q, v);
             scene.log(q, v, rows);
             return rows_to_array(std::move(rows));
           })
      .def("contact_derivatives",
           [](Scene& scene, const VectorX& q, const VectorX& v) {
             Linearization linearization(scene);
             evaluate_alone(scene, q, v);
             MatrixX by_q, by_v;
             linearization.forces(q, v, by_q, by_v);
             return std::pair(by_q, by_v);
           })
      .def_prop_ro("bristle_size", &Scene::bristle_size)
      .def("rates",
           [](Scene& scene, const VectorX& q, const VectorX& v, const VectorX& z,
              const VectorX& tau) {
             scene.restart();
             scene.evaluate(q, v, z);
             VectorX out(v.size() + z.size());
             out << scene.acceleration(q, v, tau), scene.bristle_rates();
             return out;
           })
      .def(
          "rate_jacobian",
          [](Scene& scene, const VectorX& q, const VectorX& v, const VectorX& z, const VectorX& tau,
             int repeat) {
            Linearization linearization(scene);
            scene.restart();
            scene.evaluate(q, v, z);
            MatrixX jacobian;
            for (int i = 0; i < repeat; ++i) linearization.rates(q, v, z, tau, jacobian);
            return jacobian;
          },
          nb::arg("q"), nb::arg("v"), nb::arg("z"), nb::arg("tau"), nb::arg("repeat") = 1);

  nb::class_<Controller>(m, "Controller");
  nb::class_<GravityCompensation, Controller>(m, "GravityCompensation")
      .def(nb::init<VectorX>(), nb::arg("actuated"));
  nb::class_<JointPd, Controller>(m, "JointPd")
      .def(nb::init<VectorX, VectorX, VectorX, bool, VectorX>(), nb::arg("kp"), nb::arg("kd"),
           nb::arg("q_ref"), nb::arg("gravity"), nb::arg("actuated"));
  nb::class_<PythonController, Controller>(m, "PythonController")
      .def(nb::init<nb::object>(), nb::arg("callable"));
  nb::class_<CartesianImpedance, Controller>(m, "CartesianImpedance")
      .def(
          "__init__",
          [](CartesianImpedance* self, int num_joints, int joint, const Eigen::Matrix4d& frame,
             int path_joint, const Eigen::Matrix4d& path_placement, std::vector<double> times,
             const RowPoints& points, const RowPoints& normals, double stiffness, double damping,
             double normal_force, double rotational_stiffness, double rotational_damping,
             VectorX posture_stiffness, VectorX joint_damping, VectorX q_ref, VectorX actuated) {
            ImpedanceSettings s;
            s.joint = joint;
            s.frame = to_se3(frame);
            s.path_joint = path_joint;
            s.path_placement = to_se3(path_placement);
            s.times = std::move(times);
            s.points = to_points(points);
            s.normals = to_points(normals);
            s.stiffness = stiffness;
            s.damping = damping;
            s.normal_force = normal_force;
            s.rotational_stiffness = rotational_stiffness;
            s.rotational_damping = rotational_damping;
            s.posture_stiffness = std::move(posture_stiffness);
            s.joint_damping = std::move(joint_damping);
            s.q_ref = std::move(q_ref);
            s.actuated = std::move(actuated);
            new (self) CartesianImpedance(std::move(s), num_joints);
          },
          nb::arg("num_joints"), nb::arg("joint"), nb::arg("frame"), nb::arg("path_joint"),
          nb::arg("path_placement"), nb::arg("times"), nb::arg("points"), nb::arg("normals"),
          nb::arg("stiffness"), nb::arg("damping"), nb::arg("normal_force"),
          nb::arg("rotational_stiffness"), nb::arg("rotational_damping"),
          nb::arg("posture_stiffness"), nb::arg("joint_damping"), nb::arg("q_ref"),
          nb::arg("actuated"));

  nb::class_<RunSettings>(m, "RunSettings")
      .def(
          "__init__",
          [](RunSettings* self, int integrator, double dt, double rtol, double atol,
             double duration, double start_time, double control_dt, double record_dt) {
            new (self) RunSettings{static_cast<Integrator>(integrator),
                                   dt,
                                   rtol,
                                   atol,
                                   duration,
                                   start_time,
                                   control_dt,
                                   record_dt};
          },
          nb::kw_only(), nb::arg("integrator"), nb::arg("dt"), nb::arg("rtol"), nb::arg("atol"),
          nb::arg("duration"), nb::arg("start_time"), nb::arg("control_dt"), nb::arg("record_dt"));

  nb::class_<Simulation>(m, "Simulation")
      .def(
          "__init__",
          [](Simulation* self, nb::handle model, const std::vector<const Pair*>& pairs,
             std::shared_ptr<Controller> controller, VectorX q0, VectorX v0,
             const RunSettings& settings) {
            new (self) Simulation(model_of(model), copies(pairs), settings, std::move(controller),
                                  std::move(q0), std::move(v0));
          },
          nb::arg("model"), nb::arg("pairs"), nb::arg("controller").none(), nb::arg("q0"),
          nb::arg("v0"), nb::arg("settings"))
      .def(
          "advance",
          [](Simulation& self, double wall_seconds, double until) {
            nb::gil_scoped_release release;
            return static_cast<int>(self.advance(wall_seconds, until));
          },
          nb::arg("wall_seconds"), nb::arg("until") = std::numeric_limits<double>::infinity())
      .def(
          "change",
          [](Simulation& self, const std::vector<const Pair*>& pairs,
             std::shared_ptr<Controller> controller) {
            self.change(copies(pairs), std::move(controller));
          },
          nb::arg("pairs"), nb::arg("controller").none())
      .def("push", &Simulation::push, nb::arg("joint"), nb::arg("point"), nb::arg("force_world"))
      .def("take",
           [](Simulation& self) {
             const auto& model = self.model();
             return to_dict(self.take(), model.nq, model.nv);
           })
      .def("snapshot",
           [](Simulation& self) {
             const auto& model = self.model();
             return to_dict(self.snapshot(), model.nq, model.nv);
           })
      .def_prop_ro("progress", &Simulation::progress)
      .def_prop_ro("time", &Simulation::time)
      .def_prop_ro("q", &Simulation::q)
      .def_prop_ro("v", &Simulation::v)
      .def_prop_ro("steps", &Simulation::steps)
      .def_prop_ro("full", &Simulation::full)
      .def_prop_ro("rejected", &Simulation::rejected)
      .def_prop_ro("evaluations", &Simulation::evaluations)
      .def_prop_ro("last_step", &Simulation::last_step)
      .def_prop_ro("wall_time", &Simulation::wall_time)
      .def_prop_ro("summaries", [](const Simulation& self) { return to_list(self.summaries()); });
}
