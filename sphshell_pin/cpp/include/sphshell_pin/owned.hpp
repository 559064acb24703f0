// What the public classes hold.
#pragma once

#include <memory>
#include <utility>

namespace sphshell_pin {

/// Owns an object whose type the library alone knows, and copies it with its owner.
template <class T>
class Owned {
 public:
  /// Where T is known.
  explicit Owned(T* object)
      : object_(object, [](T* of) { delete of; }), copied_([](const T& of) { return new T(of); }) {}
  Owned(const Owned& other)
      : object_(other.copied_(*other.object_), other.object_.get_deleter()),
        copied_(other.copied_) {}
  Owned(Owned&&) noexcept = default;
  Owned& operator=(Owned other) noexcept {
    std::swap(object_, other.object_);
    std::swap(copied_, other.copied_);
    return *this;
  }

  T& operator*() const { return *object_; }
  T* operator->() const { return object_.get(); }

 private:
  std::unique_ptr<T, void (*)(T*)> object_;
  T* (*copied_)(const T&);
};

}  // namespace sphshell_pin
