// The kinds of a family, as the alternatives of a variant: those of numbers alone are made by name.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
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
    const auto try_one = [&](auto* one) {
      using One = std::remove_pointer_t<decltype(one)>;
      if constexpr (std::is_constructible_v<One, const Numbers&>)
        if (kind == One::kind) made = std::make_unique<std::variant<Kind...>>(One(numbers));
    };
    (try_one(static_cast<Kind*>(nullptr)), ...);
    if (!made) throw std::invalid_argument("unknown kind '" + kind + "'");
    return std::move(*made);
  }
};

}  // namespace sphshell
