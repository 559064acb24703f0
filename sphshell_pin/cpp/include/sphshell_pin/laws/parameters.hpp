// How a law states its parameters, once for Python, the compiled core and C++ programs: each law
// has a kind and
//
//   template <class Law, class Visit> static void each(Law& law, Visit&& visit)
//
// which calls visit(name, value, bounds) for each parameter, in the order of Python's fields.
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

namespace sphshell_pin {

/// Unit and bounds of a parameter; a bound that does not exist is infinite.
struct Bounds {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  const char* unit = "";
  double above = -kNone, at_least = -kNone, at_most = kNone;
  /// A parameter before this one, with its value: a number must not exceed it, or exceed it if
  /// `beyond`; a column must have as many rows.
  const char* other = nullptr;
  double value = 0;
  bool beyond = false;

  Bounds not_above(const char* name, double most) const { return beside(name, most, false); }
  Bounds more_than(const char* name, double least) const { return beside(name, least, true); }
  Bounds beside(const char* name, double of_it, bool is_beyond) const {
    return {unit, above, at_least, at_most, name, of_it, is_beyond};
  }

  static Bounds positive(const char* unit = "") { return {unit, 0}; }
  static Bounds not_negative(const char* unit = "") { return {unit, -kNone, 0}; }
};

/// Elastic materials of the sphere, and of the shell where it has another one.
struct Materials {
  double young;                          ///< Young's modulus of the sphere, > 0 [Pa]
  double poisson;                        ///< Poisson's ratio, in (-1, 0.5]
  std::optional<double> young_2 = {};    ///< of the shell; without it that of the sphere [Pa]
  std::optional<double> poisson_2 = {};  ///< of the shell; without it that of the sphere

  /// E* [Pa]: 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2.
  double modulus() const {
    return 1 / sum([](double, double e, double nu) { return (1 - nu * nu) / e; });
  }
  /// 8 G* [Pa]: 1/G* = (2 - nu_1)/G_1 + (2 - nu_2)/G_2 with G = E / (2 (1 + nu)).
  double shear() const {
    return 8 / sum([](double softness, double, double nu) { return (2 - nu) * softness; });
  }
  /// 16/3 G [Pa]: 1/G = 1/G_1 + 1/G_2.
  double twist() const {
    return 16.0 / 3 / sum([](double softness, double, double) { return softness; });
  }

  template <class Law, class Visit>
  static void each(Law& law, Visit&& visit) {
    const Bounds young = Bounds::positive("Pa"), poisson{"", -1, -Bounds::kNone, 0.5};
    visit("young", law.young, young);
    visit("poisson", law.poisson, poisson);
    visit("young_2", law.young_2, young);
    visit("poisson_2", law.poisson_2, poisson);
  }

 private:
  // Over both bodies, of 1/G, E and nu.
  template <class Term>
  double sum(const Term& term) const {
    const auto of = [&](double e, double nu) { return term(2 * (1 + nu) / e, e, nu); };
    return of(young, poisson) + of(young_2.value_or(young), poisson_2.value_or(poisson));
  }
};

}  // namespace sphshell_pin

namespace sphshell {

using sphshell_pin::Bounds;
using sphshell_pin::Materials;
// Parameters as Python packs them: all numbers of a law in the order of `each`.
using Numbers = std::vector<double>;

// Reads one parameter after another.
struct NumberReader {
  const Numbers& numbers;
  std::size_t next = 0;

  void operator()(const char*, double& value, const Bounds&) { value = numbers.at(next++); }
  void operator()(const char*, bool& value, const Bounds&) { value = numbers.at(next++) != 0; }
  void operator()(const char*, int& value, const Bounds&) {
    value = static_cast<int>(numbers.at(next++));
  }
  // NaN: there is none.
  void operator()(const char*, std::optional<double>& value, const Bounds&) {
    const double number = numbers.at(next++);
    value = std::isnan(number) ? std::nullopt : std::optional(number);
  }
  // Columns of one length, one after the other: `next` counts them.
  void operator()(const char*, std::vector<double>& column, const Bounds&) {
    const std::size_t rows = numbers.size() / 2, from = rows * next++;
    column.assign(numbers.begin() + from, numbers.begin() + from + rows);
  }
};

// The kinds of a family, as the alternatives of a variant: those of numbers alone are made by name.
template <class Family>
struct Kinds;

template <class... Kind>
struct Kinds<std::variant<Kind...>> {
  using Family = std::variant<Kind...>;

  static std::vector<std::string> names() { return {Kind::kind...}; }

  static Family make(const std::string& kind, const Numbers& numbers) {
    std::unique_ptr<Family> made;
    of(kind, [&](auto parameters, auto* one) {
      parameters.each(parameters, NumberReader{numbers});
      made = std::make_unique<Family>(std::remove_pointer_t<decltype(one)>(parameters));
    });
    return std::move(*made);
  }

  // Calls use(parameters, a null pointer to the law) of the kind with this name.
  template <class Use>
  static void of(const std::string& kind, const Use& use) {
    bool known = false;
    const auto try_one = [&](auto* one) {
      using One = std::remove_pointer_t<decltype(one)>;
      if constexpr (!std::is_void_v<typename One::Parameters>) {
        if (kind != One::kind) return;
        known = true;
        use(typename One::Parameters{}, one);
      }
    };
    (try_one(static_cast<Kind*>(nullptr)), ...);
    if (!known) throw std::invalid_argument("unknown kind '" + kind + "'");
  }

  // The law of these parameters.
  template <class Parameters>
  static Family from(const Parameters& parameters) {
    std::unique_ptr<Family> made;
    const auto try_one = [&](auto* one) {
      using One = std::remove_pointer_t<decltype(one)>;
      if constexpr (std::is_same_v<typename One::Parameters, Parameters>)
        made = std::make_unique<Family>(One(parameters));
    };
    (try_one(static_cast<Kind*>(nullptr)), ...);
    return std::move(*made);
  }
};

}  // namespace sphshell
