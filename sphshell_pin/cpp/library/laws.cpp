#include "sphshell_pin/laws.hpp"

#include "library/checks.hpp"

namespace sphshell_pin {

// Of a force that depends on nothing but depth and gap rate: Hertz's law and foundations need the
// bodies that touch.
static const sphshell::NormalLaw& alone(const sphshell::NormalLaw& law) {
  if (law.hertz())
    throw InvalidParameter("radius", "0", "must be given where nothing is touched [m]");
  if (law.foundation()) throw InvalidParameter("law", "foundation", "needs a sphere and a shell");
  return law;
}

void BoundsCheck::operator()(const char* name, double value, const Bounds& bounds) const {
  const std::string unit = *bounds.unit ? " [" + std::string(bounds.unit) + "]" : "";
  check_finite(name, value);
  if (std::isfinite(bounds.at_most)) {
    if (!(value > bounds.above && value >= bounds.at_least && value <= bounds.at_most)) {
      const bool open = std::isfinite(bounds.above);
      const double low = open ? bounds.above : bounds.at_least;
      throw InvalidParameter(name, shown(value),
                             std::string("must lie in ") + (open ? "(" : "[") + shown(low) + ", " +
                                 shown(bounds.at_most) + "]" + unit);
    }
  } else if (bounds.above == 0) {
    check_positive(name, value, unit);
  } else {
    check_not_negative(name, value, unit);
  }
  if (!bounds.other || (bounds.beyond ? value > bounds.value : value <= bounds.value)) return;
  const char* must = bounds.beyond ? "must exceed " : "must not exceed ";
  throw InvalidParameter(name, shown(value),
                         must + std::string(bounds.other) + " = " + shown(bounds.value) +
                             (*bounds.unit ? " " + std::string(bounds.unit) : ""));
}

void BoundsCheck::operator()(const char* name, int value, const Bounds& bounds) const {
  if (value >= bounds.at_least && value <= bounds.at_most) return;
  throw InvalidParameter(
      name, std::to_string(value),
      "must be a whole number in [" + shown(bounds.at_least) + ", " + shown(bounds.at_most) + "]");
}

// Starts at zero and rises from row to row.
void BoundsCheck::operator()(const char* name, const std::vector<double>& column,
                             const Bounds& bounds) const {
  const std::string rows = std::to_string(column.size()) + " rows";
  if (column.size() < 2) throw InvalidParameter(name, rows, "must have at least 2 rows");
  for (std::size_t k = 0; k < column.size(); ++k) {
    const std::string here = name + ("[" + std::to_string(k) + "]");
    check_finite(here, column[k]);
    if (k == 0 && column[k] != 0)
      throw InvalidParameter(here, shown(column[k]), "must be 0: no depth, no force");
    if (k > 0 && column[k] <= column[k - 1])
      throw InvalidParameter(here, shown(column[k]),
                             "must be more than the row before, " + shown(column[k - 1]));
  }
  if (bounds.other && column.size() != bounds.value)
    throw InvalidParameter(
        name, rows,
        "must have as many rows as " + std::string(bounds.other) + ", " + shown(bounds.value));
}

double NormalLaw::force(double depth, double gap_rate) const {
  check_finite("depth", depth);
  check_finite("gap_rate", gap_rate);
  const sphshell::NormalLaw& law = alone(law_);
  return depth > 0 ? law.force(depth, gap_rate).total : 0.0;
}

double NormalLaw::energy(double depth) const {
  check_finite("depth", depth);
  const sphshell::NormalLaw& law = alone(law_);
  return depth > 0 ? law.energy(depth) : 0.0;
}

double FrictionLaw::coefficient(double slip_speed) const {
  return law_.coefficient(check_not_negative("slip_speed", slip_speed, " [m/s]"));
}

}  // namespace sphshell_pin
