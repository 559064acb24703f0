#include "sphshell_pin/laws.hpp"

#include "library/checks.hpp"
#include "library/impl.hpp"

namespace sphshell_pin {
namespace {

double check_poisson(const char* name, double nu) {
  if (!(check_finite(name, nu) > -1 && nu <= 0.5))
    throw InvalidParameter(name, shown(nu), "must lie in (-1, 0.5]");
  return nu;
}

// Young's modulus and Poisson's ratio of the sphere, and of the shell.
struct Both {
  double young[2], poisson[2];
};

// Without a second material both bodies are of the first one.
Both checked(const Materials& m) {
  const double young = check_positive("young", m.young, " [Pa]");
  const double poisson = check_poisson("poisson", m.poisson);
  if (m.young_2.has_value() != m.poisson_2.has_value()) {
    const auto text = [](const std::optional<double>& x) { return x ? shown(*x) : "none"; };
    throw InvalidParameter("young_2, poisson_2", text(m.young_2) + ", " + text(m.poisson_2),
                           "must be given together, or neither");
  }
  if (!m.young_2) return {{young, young}, {poisson, poisson}};
  return {{young, check_positive("young_2", *m.young_2, " [Pa]")},
          {poisson, check_poisson("poisson_2", *m.poisson_2)}};
}

// numbers(): the parameters in the order of the core's laws, checked as Python's dataclasses check
// them.
core::Numbers numbers(const ImpactLaw& law) {
  return {check_positive("stiffness", law.stiffness, " [N/m^exponent]"),
          check_positive("exponent", law.exponent, ""),
          check_not_negative("damping", law.damping, " [N s/m]"),
          check_positive("full_damping_depth", law.full_damping_depth, " [m]")};
}

core::Numbers numbers(const HuntCrossleyLaw& law) {
  return {check_positive("stiffness", law.stiffness, " [N/m^exponent]"),
          check_positive("exponent", law.exponent, ""),
          check_not_negative("dissipation", law.dissipation, " [s/m]")};
}

core::Numbers numbers(const HertzLaw& law) {
  // 4/3 sqrt(R): Hertz's scale of a sphere of that radius on a plane; 0: the gap's own.
  return {law.materials.modulus(), check_not_negative("dissipation", law.dissipation, " [s/m]"),
          check_not_negative("relaxation_time", law.relaxation_time, " [s]"),
          4.0 / 3.0 * std::sqrt(check_not_negative("radius", law.radius, " [m]"))};
}

// Starts at zero and rises from row to row.
void check_column(const std::string& name, const std::vector<double>& column) {
  if (column.size() < 2)
    throw InvalidParameter(name, std::to_string(column.size()) + " rows",
                           "must have at least 2 rows");
  for (std::size_t k = 0; k < column.size(); ++k) {
    const std::string here = name + "[" + std::to_string(k) + "]";
    check_finite(here, column[k]);
    if (k == 0 && column[k] != 0)
      throw InvalidParameter(here, shown(column[k]), "must be 0: no depth, no force");
    if (k > 0 && column[k] <= column[k - 1])
      throw InvalidParameter(here, shown(column[k]),
                             "must be more than the row before, " + shown(column[k - 1]));
  }
}

core::Numbers numbers(const TableLaw& law) {
  check_column("depth", law.depth);
  check_column("force", law.force);
  if (law.depth.size() != law.force.size())
    throw InvalidParameter("force", std::to_string(law.force.size()) + " rows",
                           "must have as many rows as depth, " + std::to_string(law.depth.size()));
  core::Numbers out = law.depth;
  out.insert(out.end(), law.force.begin(), law.force.end());
  return out;
}

core::Numbers numbers(const FoundationLaw& law) {
  return {check_positive("modulus", law.modulus, " [Pa]"),
          check_positive("thickness", law.thickness, " [m]"),
          check_not_negative("dissipation", law.dissipation, " [s/m]"), 0.0};
}

void check_coefficients(double mu_static, double mu_dynamic) {
  check_not_negative("mu_static", mu_static, "");
  check_not_negative("mu_dynamic", mu_dynamic, "");
  if (mu_dynamic > mu_static)
    throw InvalidParameter("mu_dynamic", shown(mu_dynamic),
                           "must not exceed mu_static = " + shown(mu_static));
}

core::Numbers numbers(const CoulombFriction& law) {
  check_coefficients(law.mu_static, law.mu_dynamic);
  check_positive("v_static", law.v_static, " [m/s]");
  check_positive("v_dynamic", law.v_dynamic, " [m/s]");
  if (law.v_dynamic <= law.v_static)
    throw InvalidParameter("v_dynamic", shown(law.v_dynamic),
                           "must exceed v_static = " + shown(law.v_static) + " m/s");
  return {law.mu_static, law.mu_dynamic, law.v_static, law.v_dynamic};
}

core::Numbers numbers(const BristleFriction& law) {
  check_coefficients(law.mu_static, law.mu_dynamic);
  return {law.mu_static,
          law.mu_dynamic,
          check_positive("stiffness", law.stiffness, " [N/m]"),
          check_not_negative("damping", law.damping, " [N s/m]"),
          check_positive("v_stribeck", law.v_stribeck, " [m/s]"),
          law.torsional ? 1.0 : 0.0};
}

core::Numbers numbers(const MindlinFriction& law) {
  check_coefficients(law.mu_static, law.mu_dynamic);
  const Both both = checked(law.materials);
  if (law.rings < 1 || law.rings > core::kMostRings)
    throw InvalidParameter(
        "rings", std::to_string(law.rings),
        "must be a whole number in [1, " + std::to_string(core::kMostRings) + "]");
  // 8 G* and 16/3 G: 1/G* = sum of (2 - nu)/G_k, 1/G = sum of 1/G_k.
  double along = 0, about = 0;
  for (int k = 0; k < 2; ++k) {
    const double softness = 2 * (1 + both.poisson[k]) / both.young[k];
    along += (2 - both.poisson[k]) * softness;
    about += softness;
  }
  return {law.mu_static,
          law.mu_dynamic,
          8 / along,
          16.0 / 3 / about,
          check_positive("v_stribeck", law.v_stribeck, " [m/s]"),
          check_not_negative("damping_time", law.damping_time, " [s]"),
          law.torsional ? 1.0 : 0.0,
          check_not_negative("rolling", law.rolling, ""),
          check_positive("rolling_speed", law.rolling_speed, " [m/s]"),
          static_cast<double>(law.rings)};
}

// Of a force that depends on nothing but depth and gap rate.
// Hertz's law and foundations need the bodies that touch.
const core::NormalLaw& alone(const core::NormalLaw& law) {
  if (law.hertz())
    throw InvalidParameter("radius", "0", "must be given where nothing is touched [m]");
  if (law.foundation()) throw InvalidParameter("law", "foundation", "needs a sphere and a shell");
  return law;
}

}  // namespace

// 1 / E* = sum of (1 - nu^2) / E over both bodies.
double Materials::modulus() const {
  const Both both = checked(*this);
  double softness = 0;
  for (int k = 0; k < 2; ++k) softness += (1 - both.poisson[k] * both.poisson[k]) / both.young[k];
  return 1 / softness;
}

NormalLaw::NormalLaw(const ImpactLaw& law) : impl_(new Impl{{core::ImpactLaw(numbers(law))}}) {}
NormalLaw::NormalLaw(const HuntCrossleyLaw& law)
    : impl_(new Impl{{core::HuntCrossleyLaw(numbers(law))}}) {}
NormalLaw::NormalLaw(const HertzLaw& law) : impl_(new Impl{{core::HertzLaw(numbers(law))}}) {}
NormalLaw::NormalLaw(const TableLaw& law) : impl_(new Impl{{core::TableLaw(numbers(law))}}) {}
NormalLaw::NormalLaw(const FoundationLaw& law)
    : impl_(new Impl{{core::FoundationLaw(numbers(law))}}) {}

double NormalLaw::force(double depth, double gap_rate) const {
  check_finite("depth", depth);
  check_finite("gap_rate", gap_rate);
  const core::NormalLaw& law = alone(impl_->law);
  return depth > 0 ? law.force(depth, gap_rate).total : 0.0;
}

double NormalLaw::energy(double depth) const {
  check_finite("depth", depth);
  const core::NormalLaw& law = alone(impl_->law);
  return depth > 0 ? law.energy(depth) : 0.0;
}

FrictionLaw::FrictionLaw(const NoFriction&) : impl_(new Impl{{core::NoFriction({})}}) {}
FrictionLaw::FrictionLaw(const CoulombFriction& law)
    : impl_(new Impl{{core::CoulombFriction(numbers(law))}}) {}
FrictionLaw::FrictionLaw(const BristleFriction& law)
    : impl_(new Impl{{core::BristleFriction(numbers(law))}}) {}
FrictionLaw::FrictionLaw(const MindlinFriction& law)
    : impl_(new Impl{{core::MindlinFriction(numbers(law))}}) {}

bool FrictionLaw::has_state() const { return impl_->law.has_state(); }

double FrictionLaw::coefficient(double slip_speed) const {
  return impl_->law.coefficient(check_not_negative("slip_speed", slip_speed, " [m/s]"));
}

}  // namespace sphshell_pin
