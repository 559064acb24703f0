#include <sphshell_pin/laws.hpp>

#include <limits>
#include <utility>

#include "check.hpp"

using namespace sphshell_pin;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

void forces_are_those_of_the_formulas() {
  const NormalLaw impact = ImpactLaw{1e6, 1.5, 20, 1e-4};
  CHECK_NEAR(impact.force(4e-4), 1e6 * std::pow(4e-4, 1.5), 1e-12);
  CHECK_NEAR(impact.force(4e-4, -0.1), 8 + 2, 1e-12);
  CHECK_NEAR(impact.energy(4e-4), 8 * 4e-4 / 2.5, 1e-15);
  CHECK(impact.force(4e-4, 1) == 0);  // it never pulls
  CHECK(impact.force(-1e-3) == 0);
  const NormalLaw hunt = HuntCrossleyLaw{1e6, 1, 0.5};
  CHECK_NEAR(hunt.force(1e-3, -0.2), 1e3 * 1.1, 1e-9);
  // Johnson, Contact Mechanics, 4.2: F = 4/3 E* sqrt(R) d^1.5.
  HertzLaw on_plane{{210e9, 0.3}};
  on_plane.radius = 0.01;
  const double modulus = 210e9 / (2 * (1 - 0.09));
  CHECK_NEAR(on_plane.materials.modulus() / modulus, 1, 1e-15);
  CHECK_NEAR(NormalLaw(on_plane).force(1e-5) / (4.0 / 3 * modulus * 0.1 * std::pow(1e-5, 1.5)), 1,
             1e-14);
  // What is left out of the second material is that of the first.
  const Materials half{1e9, 0.3, 2e9}, whole{1e9, 0.3, 2e9, 0.3};
  CHECK(half.modulus() == whole.modulus() && half.shear() == whole.shear());
  const NormalLaw table = TableLaw{{0, 1e-3, 2e-3}, {0, 1, 2}};
  CHECK_NEAR(table.force(1.5e-3), 1.5, 1e-14);
  CHECK_NEAR(table.energy(2e-3), 2e-3, 1e-17);
}

void friction_is_that_of_the_formulas() {
  const FrictionLaw coulomb = CoulombFriction{0.5, 0.4, 0.005, 0.05};
  CHECK(!coulomb.has_state());
  CHECK_NEAR(coulomb.coefficient(0.005), 0.5, 1e-15);
  CHECK_NEAR(coulomb.coefficient(1), 0.4, 1e-15);
  const FrictionLaw bristle = BristleFriction{0.5, 0.4, 1e4};
  CHECK(bristle.has_state());
  CHECK_NEAR(bristle.coefficient(0.01), 0.4 + 0.1 * std::exp(-1.0), 1e-15);
  CHECK(FrictionLaw().coefficient(1) == 0);
  MindlinFriction mindlin{0.5, 0.5, {1e9, 0.3}};
  mindlin.rings = 8;
  CHECK(FrictionLaw(mindlin).has_state());
}

void laws_that_were_moved_stay_laws() {
  NormalLaw table = TableLaw{{0, 1e-3}, {0, 1}};
  FrictionLaw coulomb = CoulombFriction{0.5, 0.4, 0.005, 0.05};
  const NormalLaw normal = std::move(table);
  const FrictionLaw friction = std::move(coulomb);
  CHECK(table.force(1e-3) == normal.force(1e-3));
  CHECK(coulomb.coefficient(1) == friction.coefficient(1));
}

void bad_numbers_are_refused() {
  using E = InvalidParameter;
  CHECK_THROWS(E, "stiffness = -1 must be positive [N/m^exponent]", NormalLaw(ImpactLaw{-1}));
  CHECK_THROWS(E, "stiffness = nan must be finite", NormalLaw(ImpactLaw{kNan}));
  CHECK_THROWS(E, "exponent = inf must be finite", NormalLaw(ImpactLaw{1, kInfinite}));
  CHECK_THROWS(E, "damping = -0.1 must not be negative [N s/m]", NormalLaw(ImpactLaw{1, 1, -0.1}));
  CHECK_THROWS(E, "full_damping_depth = 0 must be positive", NormalLaw(ImpactLaw{1, 1, 0, 0}));
  CHECK_THROWS(E, "dissipation = nan", NormalLaw(HuntCrossleyLaw{1, 1, kNan}));
  CHECK_THROWS(E, "poisson = 0.6 must lie in (-1, 0.5]", NormalLaw(HertzLaw{{1e9, 0.6}}));
  CHECK_THROWS(E, "young_2 = -1 must be positive [Pa]", NormalLaw(HertzLaw{{1e9, 0.3, -1}}));
  CHECK_THROWS(E, "radius = 0 must be given where nothing is touched",
               NormalLaw(HertzLaw{{1e9, 0.3}}).force(1e-3));
  CHECK_THROWS(E, "needs a sphere and a shell", NormalLaw(FoundationLaw{1e6, 1e-3}).energy(1e-3));
  CHECK_THROWS(E, "thickness = 0 must be positive [m]", NormalLaw(FoundationLaw{1e6, 0}));
  CHECK_THROWS(E, "depth = 0 rows must have at least 2 rows", NormalLaw(TableLaw{{}, {}}));
  CHECK_THROWS(E, "depth[0] = 1 must be 0", NormalLaw(TableLaw{{1, 2}, {0, 1}}));
  CHECK_THROWS(E, "force[2] = 1 must be more than the row before, 1",
               NormalLaw(TableLaw{{0, 1, 2}, {0, 1, 1}}));
  CHECK_THROWS(E, "must have as many rows as depth, 2", NormalLaw(TableLaw{{0, 1}, {0, 1, 2}}));
  CHECK_THROWS(E, "gap_rate = nan must be finite", NormalLaw(ImpactLaw{1}).force(1, kNan));
  CHECK_THROWS(E, "mu_dynamic = 0.5 must not exceed mu_static = 0.25",
               FrictionLaw(CoulombFriction{0.25, 0.5}));
  CHECK_THROWS(E, "v_dynamic = 0.1 must exceed v_static = 0.1 m/s",
               FrictionLaw(CoulombFriction{0.5, 0.5, 0.1, 0.1}));
  CHECK_THROWS(E, "stiffness = 0 must be positive [N/m]", FrictionLaw(BristleFriction{1, 1, 0}));
  MindlinFriction rings{1, 1, {1e9, 0.3}};
  rings.rings = 9;
  CHECK_THROWS(E, "rings = 9 must be a whole number in [1, 8]", FrictionLaw{rings});
  CHECK_THROWS(E, "slip_speed = -1 must not be negative", FrictionLaw().coefficient(-1));
}

}  // namespace

int main() {
  forces_are_those_of_the_formulas();
  friction_is_that_of_the_formulas();
  laws_that_were_moved_stay_laws();
  bad_numbers_are_refused();
}
