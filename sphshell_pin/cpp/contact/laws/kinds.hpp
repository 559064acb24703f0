// The kinds of a family, as the alternatives of a variant: they are made by name.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

namespace sphshell {

// Parameters as Python packs them: the fields of the dataclass in their order.
using Numbers = std::vector<double>;

template <class Family>
struct Kinds;

template <class... Kind>
struct Kinds<std::variant<Kind...>> {
  static std::vector<std::string> names() { return {Kind::kind...}; }

  static std::variant<Kind...> make(const std::string& kind, const Numbers& numbers) {
    std::unique_ptr<std::variant<Kind...>> made;
    ((kind == Kind::kind ? made = std::make_unique<std::variant<Kind...>>(Kind(numbers)) : made),
     ...);
    if (!made) throw std::invalid_argument("unknown kind '" + kind + "'");
    return std::move(*made);
  }
};

}  // namespace sphshell
